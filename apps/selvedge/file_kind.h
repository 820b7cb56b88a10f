// Which of our files a path is.
#pragma once

#include <string>

#include "format/base/error.h"

namespace selvedge {

enum class FileKind { fabric, samples, gltf };

/// By content, not by name: OpenEXR with our attributes, GLB, or JSON. Anything else is FILE_UNREADABLE.
Result<FileKind> kind_of(const std::string& path);

const char* name_of(FileKind kind);

}  // namespace selvedge
