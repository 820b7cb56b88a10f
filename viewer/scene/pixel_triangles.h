// Sixteen pixels, which are looked up together.
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

}  // namespace selvedge
