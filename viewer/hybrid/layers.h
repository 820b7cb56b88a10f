// Composites the surfaces at each pixel from front to back until nothing more shows through.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "viewer/hybrid/deep_pixels.h"
#include "viewer/hybrid/shade.h"
#include "viewer/raster/raster.h"

namespace selvedge {

/// Maximum number of surfaces that a pixel can show behind each other.
inline constexpr int max_layers = 64;

/// Statistics of a band.
struct LayerCount {
  std::int64_t covered_pixels = 0;    ///< pixels that are not empty
  std::int64_t evaluated_pixels = 0;  ///< over all layers
  std::int64_t cloth_pixels = 0;      ///< of these, with fabric that is not clear
  int layers = 0;                     ///< largest number in one pixel
  LayerCount& operator+=(const LayerCount& b);
};

/// The surfaces at a band's pixels.
struct BandSurfaces {
  std::array<DrawnSide, 2>
      sides;                     ///< front and back, as OpenGL has drawn them; of a cast band only the lists
  std::array<Raster, 2> raster;  ///< of a cast band, and of another one with deep pixels
  bool is_cpu_raster = false;
  /// At y * width + x, no_triangle_side: none. Memory of shade_band().
  std::vector<TriangleSide> nearest, behind;
  bool has_pbr() const { return !sides[0].visible.colours.empty(); }
  PbrPixel pbr_at(TriangleSide surface, std::size_t i) const { return sides[surface % 2].pbr_at(i); }
  /// Sets up `raster` from the lists.
  void draw_band(const FrameScene& scene, int first_row, int rows);
};

/// Shades and overwrites the pixels of a band, at most `layers` surfaces deep, on all cores. In a scene with
/// surfaces without fabric only the nearest surface of deep pixels; if more shows behind it, they are added
/// to `deep`.
LayerCount shade_band(const FrameScene& scene, CellPass& cells, BandSurfaces& surfaces, int layers,
                      const BandPixels& pixels, DeepPixels& deep);

/// The other surfaces of deep pixels of such a scene. Precondition: all their layers are known.
LayerCount shade_deep_pixels(const FrameScene& scene, CellPass& cells, DeepPixels& deep, int layers,
                             const BandPixels& pixels);

/// Light of one surface at a pixel, counted from the lower left. Its cell image has been made.
V4f shade_surface(const FrameScene& scene, TriangleSide seen, const V2i& pixel, const PbrPixel& pbr);

}  // namespace selvedge
