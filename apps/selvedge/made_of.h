// What a fabric is made of, by digest: tells whether it is up to date.
#pragma once

#include <string>

#include "apps/selvedge/command_line.h"

namespace selvedge {

/// Digest of the program's version, the stitch's name, the options that the fabric depends on, and the names
/// and contents of the files that it is made of. Errors of reading them.
Result<std::string> digest_of_inputs(const MakeCommand& command);

/// A provenance with this digest as `make/inputs`.
std::string with_inputs(const std::string& provenance, const std::string& digest);
/// The provenance of a fabric that its make no longer describes.
std::string without_inputs(const std::string& provenance);

/// Whether the output is a fabric with this digest; its header alone is read.
bool is_up_to_date(const std::string& output, const std::string& digest);

/// Writes "output: inputs" as Make and Ninja read it (`gcc -MD`).
Result<void> write_depfile(const std::string& path, const MakeCommand& command);

}  // namespace selvedge
