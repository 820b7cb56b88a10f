// The index pass (paper section 6): finds, for sixteen pixels at once, the texels of the fabric with their
// weights, and the garment's frame, from the triangle at each pixel. Shading follows later.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "format/fabric/level_options.h"
#include "format/scene/footprint.h"
#include "viewer/hybrid/evaluate_lanes.h"
#include "viewer/scene/mesh.h"

namespace selvedge {

struct IndexScene {
  const MergedSurfaces& mesh;
  const ProjectedVertices& projected;
  std::span<const SurfaceMaterial> materials;  ///< of the surfaces
  std::span<const PackedFabric> fabrics;
  LevelOptions levels;
  bool paper_bits = false;  ///< as published: what OpenGL wrote is rounded to colours of 8 bits
  bool cells = true;        ///< yarn shows by cell images where pixels are small; else texels show everywhere
};

/// The surfaces at these pixels.
struct PixelPlaces {
  std::size_t count = 0;
  std::array<std::uint16_t, lane_count> x{};
  std::array<std::uint16_t, lane_count> y{};
  alignas(64) LaneFloats from_middle_x{};  ///< of the pixel's centre, in pixels, from the centre of the frame
  alignas(64) LaneFloats from_middle_y{};  ///< upwards
  std::array<std::uint32_t, lane_count> surface{};
  std::array<std::uint32_t, lane_count> triangle{};  ///< index into MergedSurfaces::triangles
  alignas(64) LaneFloats second_corner{};  ///< barycentric coordinates of the triangle's second corner ...
  alignas(64) LaneFloats third_corner{};   ///< ... and third
  LaneDirections normal;                   ///< interpolated, not normalised
  LaneDirections tangent;                  ///< the same
  alignas(64) LaneFloats handedness{};     ///< of the tangents (surfaces.h)
  alignas(64) LaneFloats side{};           ///< 1 where the front is seen, -1 where the back is
  std::array<PbrPixel, lane_count> pbr{};
  bool bent = false;  ///< by the slopes, which are 0 where SurfaceMaterial::bends is false
  alignas(64) LaneFloats slope_x{}, slope_y{};
  /// Weight of the yarn itself, beside the texels; texture coordinates without whole repeats, and their
  /// change per pixel to the right and up.
  bool shows_yarn = false;
  alignas(64) LaneFloats yarn{};
  alignas(64) LaneFloats u{}, v{}, u_right{}, v_right{}, u_up{}, v_up{};
  V2f uv(std::size_t lane) const { return {u[lane], v[lane]}; }
  V2f uv_right(std::size_t lane) const { return {u_right[lane], v_right[lane]}; }
  V2f uv_up(std::size_t lane) const { return {u_up[lane], v_up[lane]}; }
};

/// The inputs of shading for these pixels.
struct PixelBlock : PixelPlaces {
  /// Texels of the fabrics; their weights and the yarn's sum to 1.
  std::size_t texel_count = 0;
  std::array<LaneTexels, std::size_t{2} * max_pixel_texels * max_pixel_texels + 1> texels;
};

void find_texels(const IndexScene& scene, const PixelTriangles& pixels, PixelBlock& block);

}  // namespace selvedge
