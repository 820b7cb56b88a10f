// glTF files through tinygltf, an independent reader and writer.
#pragma once

#include <string>

namespace selvedge::test {

/// Loads and saves a file with tinygltf, pictures kept as they are; says what went wrong, or nothing.
std::string pass_through_tinygltf(const std::string& from, const std::string& to, bool binary);

}  // namespace selvedge::test
