// Sixteen pixels, which are shaded together.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "viewer/scene/material.h"

namespace selvedge {

inline constexpr std::size_t lane_count = 16;

using LaneFloats = std::array<float, lane_count>;

/// A triangle as it is seen: twice its index in MergedSurfaces::triangles, + 1 for its back.
using SeenSurface = std::uint32_t;
inline constexpr SeenSurface no_surface = ~SeenSurface{0};

/// Pixels of a frame in any order, each with its visible triangle.
struct PixelTriangles {
  std::size_t count = 0;                             ///< number of pixels in use; at least 1
  std::array<std::uint16_t, lane_count> x{};         ///< pixel of the frame
  std::array<std::uint16_t, lane_count> y{};         ///< counted from the bottom
  std::array<std::uint32_t, lane_count> triangle{};  ///< index into MergedSurfaces::triangles
  std::array<bool, lane_count> back{};
  bool has_pbr = false;  ///< some surface of the scene needs `pbr`
  std::array<PbrPixel, lane_count> pbr{};
};

}  // namespace selvedge
