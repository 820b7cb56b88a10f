// From the surfaces that lie behind each other at a pixel to its colour, nearest first, until nothing more
// shows through.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "viewer/hybrid/deep_pixels.h"
#include "viewer/hybrid/shade.h"

namespace selvedge {

/// The most surfaces behind each other that a pixel can show.
inline constexpr int max_layers = 64;

/// What is left to be seen when a pixel counts as opaque: less than half a step of an 8-bit picture.
inline constexpr float opaque_rest = 0.5F / 255;
inline bool is_open(const V4f& pixel) { return !(1 - pixel.w < opaque_rest); }

/// What a band did.
struct LayerCount {
  std::int64_t covered = 0;    ///< pixels in which something is seen
  std::int64_t evaluated = 0;  ///< over all layers
  int layers = 0;              ///< the most in one pixel
  LayerCount& operator+=(const LayerCount& b);
};

/// Shades the pixels of a band, which are overwritten, at most `layers` surfaces deep; on all cores. Deep
/// pixels stay empty and are given back in `deep`.
LayerCount shade_band(const IndexScene& index, const ShadingScene& shading,
                      const std::array<DrawnSide, 2>& sides, int layers, const BandPixels& pixels,
                      DeepPixels& deep);

/// The same for the deep ones, all of whose layers are known by now.
LayerCount shade_deep(const IndexScene& index, const ShadingScene& shading, const DeepPixels& deep,
                      int layers, const BandPixels& pixels);

}  // namespace selvedge
