// The samples of one texel in its frame, in the layout of the fit.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "format/samples/samples.h"

namespace selvedge {

/// All pairs of a view and a light above the texel's horizon; for other lights the model is zero. Directions
/// are unit and in the texel's frame (tangent, binormal, normal).
struct TexelSamples {
  /// Views are padded to whole groups of this many; the padding has weight 0 and radiance 0.
  static constexpr std::size_t lanes = 16;

  std::vector<V3f> lights;                     ///< z > 0
  std::vector<std::uint32_t> light_index;      ///< of each of `lights`, among all lights
  std::array<std::vector<float>, 3> view_xyz;  ///< x, y and z of each view; padded
  /// Opacity per view, padded: a mip texel then has the minimiser of its children.
  std::vector<double> view_weights;
  /// Per colour channel, radiance[c][light * stride() + view], in units of scale[c].
  std::array<std::vector<float>, 3> radiance;
  /// A power of two per channel for which radiance is at most 1, so that single precision does not overflow.
  std::array<double, 3> scale{1, 1, 1};
  std::size_t view_count = 0;
  /// Layout of the views, which defines neighbours; 0 x 0: no neighbours.
  DirectionGrid grid{0, 0};

  std::size_t stride() const { return view_weights.size(); }
};

/// Directions of a texel's samples, not in the texel's frame.
struct TexelDirections {
  std::vector<V3f> views;
  std::vector<V3f> lights;
  DirectionGrid grid{0, 0};  ///< of the views, or 0 x 0
};

/// `alpha`: [view]; `radiance`: [view * lights + light], both of one texel. `normal` and `tangent` are unit
/// and perpendicular, in the frame of the directions.
TexelSamples gather_texel(const float* alpha, const V3f* radiance, const TexelDirections& directions,
                          const V3f& normal, const V3f& tangent);

}  // namespace selvedge
