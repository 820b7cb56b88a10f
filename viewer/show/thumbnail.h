// Small pictures of fabrics to choose from.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "format/base/error.h"

namespace selvedge {

/// A fabric that is not read until it is worn.
struct OfferedFabric {
  std::string path;
  std::vector<std::uint8_t> picture;  ///< thumbnail_side x thumbnail_side, in display.h's form
};

inline constexpr int thumbnail_side = 96;

/// Draws two repeats of a fabric file from near. Errors are those of the file.
Result<OfferedFabric> offer_of(const std::string& path, std::uint64_t max_memory);

/// The fabric files (.exr) of a folder, sorted by name; without an error, as it may be no folder.
std::vector<std::string> fabrics_in(const std::string& folder);

}  // namespace selvedge
