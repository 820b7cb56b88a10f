// The samples of one texel in its own frame, ready for the fit.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "format/samples/samples.h"

namespace selvedge {

/// All pairs of a view and a light that is above the texel's horizon. The other lights give zero in the model
/// whatever its parameters are, and so take no part in a fit. Directions are unit and in the texel's frame
/// (tangent, binormal, normal).
struct TexelSamples {
  /// Views are padded to whole groups of this many; the padding has weight 0 and radiance 0.
  static constexpr std::size_t lanes = 16;

  std::vector<V3f> lights;                 ///< z > 0
  std::vector<std::uint32_t> light_of;     ///< of each: its index among all lights
  std::size_t all_lights = 0;              ///< those below the horizon as well
  std::array<std::vector<float>, 3> view;  ///< x, y and z of each view; padded
  std::vector<double>
      weight;  ///< per view, padded: opacity, so that a mip texel has its children's minimiser
  /// Per colour channel, radiance[c][light * stride() + view], in units of scale[c].
  std::array<std::vector<float>, 3> radiance;
  /// A power of two per channel that makes radiance at most 1: nothing overflows in single precision.
  std::array<double, 3> scale{1, 1, 1};
  std::size_t views = 0;
  /// Layout of the views, which says which are neighbours; 0 x 0: no two are. Likewise of all lights.
  DirectionGrid grid{0, 0};
  DirectionGrid light_grid{0, 0};
  double energy_below_horizon = 0;  ///< weighted squared radiance below the horizon, all channels, unscaled

  std::size_t stride() const { return weight.size(); }
};

/// Directions as given, not in the texel's frame, as the samples of one texel have them.
struct TexelDirections {
  std::vector<V3f> views;
  std::vector<V3f> lights;
  DirectionGrid grid{0, 0};        ///< of the views, where they are on one
  DirectionGrid light_grid{0, 0};  ///< of the lights
};

/// `alpha`: [view]; `radiance`: [view * lights + light], both of one texel. `normal` and `tangent` are unit
/// and perpendicular, in the frame of the directions.
TexelSamples gather_texel(const float* alpha, const V3f* radiance, const TexelDirections& directions,
                          const V3f& normal, const V3f& tangent);

}  // namespace selvedge
