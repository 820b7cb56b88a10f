// Finds the kind of a file (fabric, samples, glTF), and checks a file of any kind.
#pragma once

#include <string>

#include "format/base/error.h"
#include "format/gltf/limits.h"

namespace selvedge {

enum class FileKind { fabric, samples, gltf };

/// By content, not by name: OpenEXR with our attributes, GLB, or JSON. Anything else is FILE_UNREADABLE.
Result<FileKind> kind_of(const std::string& path);

const char* name_of(FileKind kind);

/// A fabric, a samples file (only its first error) or a glTF, as `kind` says.
Issues check_file(const std::string& path, FileKind kind, const SceneLimits& limits = {});

}  // namespace selvedge
