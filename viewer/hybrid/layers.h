// Composites the surfaces at each pixel from front to back until nothing more shows through.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "viewer/hybrid/deep_pixels.h"
#include "viewer/hybrid/shade.h"

namespace selvedge {

/// Maximum number of surfaces that a pixel can show behind each other.
inline constexpr int max_layers = 64;

/// Statistics of a band.
struct LayerCount {
  std::int64_t covered = 0;    ///< pixels that are not empty
  std::int64_t evaluated = 0;  ///< over all layers
  int layers = 0;              ///< largest number in one pixel
  LayerCount& operator+=(const LayerCount& b);
};

/// Shades and overwrites the pixels of a band, at most `layers` surfaces deep, on all cores. Of deep pixels
/// only the nearest surface; if more shows behind it, they are added to `deep`.
LayerCount shade_band(const IndexScene& index, const ShadingScene& shading, CellPass& cells,
                      const std::array<DrawnSide, 2>& sides, int layers, const BandPixels& pixels,
                      DeepPixels& deep);

/// The other surfaces of deep pixels. Precondition: all their layers are known.
LayerCount shade_deep(const IndexScene& index, const ShadingScene& shading, CellPass& cells,
                      const DeepPixels& deep, int layers, const BandPixels& pixels);

}  // namespace selvedge
