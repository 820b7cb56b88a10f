// Evaluates a fabric for sixteen pixels at once: the fast twin of format/fabric/evaluate.h, held to it by
// tests. Both use the template of format/fabric/lafortune.h; powers come from format/simd/powers.h.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "format/fabric/smooth_light.h"
#include "viewer/frame/options.h"
#include "viewer/scene/packed_fabric.h"
#include "viewer/scene/pixel_triangles.h"

namespace selvedge {

/// Unit vectors in the fabric's frame.
struct LaneDirections {
  alignas(64) LaneFloats x{};
  alignas(64) LaneFloats y{};
  alignas(64) LaneFloats z{};
};

/// A colour for each pixel.
using LaneColours = std::array<LaneFloats, 3>;

struct LaneLight {
  LaneDirections direction;  ///< towards the light
  alignas(64) LaneFloats share{};
  V3f irradiance{1, 1, 1};               ///< on a surface that faces the light; times `share`
  const LaneColours* colours = nullptr;  ///< if not null, takes the place of `irradiance`
  bool of_environment = false;           ///< Light::of_environment
};

/// Smooth light from all around in the axes of each pixel (smooth_light.h).
struct LaneSmoothLight {
  alignas(64) std::array<LaneColours, smooth_functions> factors;
};

/// One texel for each pixel, and its weight. If the weight is 0, texel and level are undefined.
struct LaneTexels {
  alignas(64) LaneFloats weight{};
  alignas(64) std::array<std::int32_t, lane_count> texel{};
  alignas(64) std::array<std::int32_t, lane_count> level{};
};

/// Sums over texels of weight * alpha * radiance, and of weight * alpha.
struct LaneShading {
  alignas(64) LaneFloats red{};
  alignas(64) LaneFloats green{};
  alignas(64) LaneFloats blue{};
  alignas(64) LaneFloats alpha{};
};

/// Sums over texels of weight times alpha times coefficients, of levels of one layout, which are of products
/// alone.
struct MeanProducts {
  const PackedLayout* layout;
  float* sums;  ///< [lane][4 * layout->coefficient_groups()], 0 at first
};

/// Memory that calls reuse; one per thread.
struct LaneScratch {
  std::vector<float> view_functions;
  std::vector<float> light_functions;
  std::vector<float> rows;
  std::vector<float> of_lights;
  std::vector<MeanProducts> means;
  std::vector<LaneLight> lamps;          ///< instead of light from all around
  std::vector<LaneColours> colours;      ///< of `lamps`
  std::vector<LaneLight> behind;         ///< lights that come through, mirrored
  std::vector<std::vector<float>> sums;  ///< of `means`
};

/// Adds `texels` (any number of them) of one fabric, seen from `view` under all `lights` and in the light
/// from all `around`, if any, to `sum`; light from behind by PackedFabric::through. Levels
/// and texels must exist. Levels that are not of products alone see the light from around as twelve lamps.
void evaluate_lanes(const PackedFabric& fabric, std::span<const LaneTexels> texels,
                    const LaneDirections& view, std::span<const LaneLight> lights, LaneScratch& scratch,
                    LaneShading& sum, const LaneSmoothLight* around = nullptr);

}  // namespace selvedge
