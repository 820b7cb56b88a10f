// What a Draco bitstream claims to hold, read before anything is decoded: its decoder allocates what it is
// told to.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace selvedge {

struct DracoCounts {
  std::uint64_t faces = 0;
  std::uint64_t points = 0;  ///< connectivity only: seams of attributes add some
};

/// The counts of a mesh, sequential or edgebreaker, of bitstream versions 1.x and 2.x; nothing for what is
/// none or is cut short.
std::optional<DracoCounts> draco_counts(std::span<const std::uint8_t> bytes);

}  // namespace selvedge
