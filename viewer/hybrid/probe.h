// Probes the nearest surface at a pixel for its texels and their weights.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "viewer/hybrid/layers.h"

namespace selvedge {

/// The texel of a level at the middle of a pixel.
struct ProbedTexel {
  int level = 0;    ///< -1: the yarn itself
  V2i texel{0, 0};  ///< row 0 at the top
  float weight = 0;
};

/// The nearest surface at a pixel. Directions are in the fabric's frame.
struct PixelProbe {
  V2i pixel{0, 0};  ///< from the frame's top left
  std::uint32_t surface = 0;
  std::uint32_t triangle = 0;  ///< index into MergedSurfaces::triangles
  bool is_back = false;        ///< the back of the cloth is visible
  V3d position{0, 0, 0};       ///< m, world
  int fabric = -1;             ///< -1: the surface has neither fabric nor texels
  V2d uv{0, 0};                ///< in [0, 1], without whole repeats
  V2d texels_per_pixel{0, 0};  ///< of the whole fabric's level 0, along u and v
  std::vector<ProbedTexel> texels;
  V3f to_viewer{0, 0, 1};      ///< unit, towards the viewer
  std::vector<V3f> to_lights;  ///< unit, towards each light
  V3f radiance{0, 0, 0};       ///< not multiplied by alpha
  float alpha = 0;
};

/// `pixel`: from the lower left. Its cell image has been made.
PixelProbe probe_pixel(const FrameScene& scene, TriangleSide seen, const V2i& pixel, const PbrPixel& pbr);

}  // namespace selvedge
