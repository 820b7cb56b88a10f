// Files that people take for ours, known by their first bytes.
#pragma once

#include <string_view>

#include "format/base/input_file.h"

namespace selvedge {

/// The kind of a file that nothing here reads, and the remedy, as the message of an error ("is compressed by
/// gzip: unpack it first"); empty for all others.
std::string_view foreign_file_message(std::string_view bytes);
std::string_view foreign_file_message(const InputFile& file);

}  // namespace selvedge
