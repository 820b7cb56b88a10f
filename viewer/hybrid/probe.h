// What the nearest surface shows at a pixel: its texels with their weights, and lines where texels end.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "viewer/hybrid/layers.h"

namespace selvedge {

/// A texel that a pixel sees.
struct ProbedTexel {
  int level = 0;
  V2i texel{0, 0};  ///< row 0 at the top
  float weight = 0;
};

/// The nearest surface at a pixel. Directions are in the fabric's frame.
struct PixelProbe {
  V2i pixel{0, 0};  ///< from the frame's top left
  std::uint32_t surface = 0;
  std::uint32_t triangle = 0;  ///< index into MergedSurfaces::triangles
  bool back = false;           ///< of the cloth is seen
  V3d position{0, 0, 0};       ///< m, world
  int fabric = -1;             ///< -1: the surface has none, nor any texels
  V2d uv{0, 0};                ///< in [0, 1): whole repeats are left out
  V2d texels_per_pixel{0, 0};  ///< of the whole fabric's level 0, along u and v
  std::vector<ProbedTexel> texels;
  V3f view{0, 0, 1};        ///< unit, towards the viewer
  std::vector<V3f> lights;  ///< unit, towards each light
  V3f radiance{0, 0, 0};    ///< not multiplied by alpha
  float alpha = 0;
};

struct NearestSurface {
  std::uint32_t triangle = 0;  ///< index into MergedSurfaces::triangles
  bool back = false;
};

/// What the first round shows at pixel `i` of a band; none where that is nothing.
std::optional<NearestSurface> nearest_surface(const std::array<DrawnSide, 2>& sides, std::size_t i);

/// Precondition: `pixels` holds one pixel, and `shading` the mesh.
PixelProbe probe_pixel(const IndexScene& index, const ShadingScene& shading, const PixelTriangles& pixels);

/// Red, green, blue and opacity of an overlay, for a display.
using OverlayPixel = std::array<std::uint8_t, 4>;

/// Lines of about a pixel's width where texels of the finer level that a pixel shows end, in another colour
/// where the fabric repeats. They fade where texels become smaller than a few pixels. Writes all pixels
/// of the band; `overlay` is the whole frame, top row first.
void draw_texel_edges(const IndexScene& index, const std::array<DrawnSide, 2>& sides, int first_row, int rows,
                      std::vector<OverlayPixel>& overlay);

}  // namespace selvedge
