// Every broken rule of a file, whichever of ours it is.
#pragma once

#include <string>

#include "apps/selvedge/file_kind.h"

namespace selvedge {

/// A fabric, a samples file (only its first error) or a glTF, as `kind` says.
Issues check_file(const std::string& path, FileKind kind);

}  // namespace selvedge
