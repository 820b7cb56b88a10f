// Small pictures of fabrics to choose from.
#pragma once

#include <atomic>
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

/// Draws two repeats of a fabric file from near; ends soon, with any picture, once `interrupted` is true.
/// Errors as of reading the file.
Result<OfferedFabric> offer_of(const std::string& path, std::uint64_t max_memory,
                               const std::atomic<bool>& interrupted);

/// The fabric files (.exr) of a folder, sorted by name; none where it cannot be read.
std::vector<std::string> fabrics_in(const std::string& folder);

}  // namespace selvedge
