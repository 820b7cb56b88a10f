// The samples of one texel in its own frame, ready for the fit.
#pragma once

#include <vector>

#include "format/samples.h"

namespace selvedge {

/// Samples whose light is above the texel's horizon, in the order of views, then lights. The others are zero in
/// the model whatever its parameters are, and so take no part in a fit.
struct TexelSamples {
  struct Sample {
    V3d product{0, 0, 0};  ///< l'x v'x, l'y v'y, l'z v'z
    double cosine = 0;     ///< l'z > 0
    V3d radiance{0, 0, 0};
  };
  std::vector<Sample> samples;
  std::vector<std::size_t> first;  ///< per view, and one past the end: where its samples begin
  std::vector<double> weight;      ///< per view: opacity, so that a mip texel has its children's minimiser
  double unreachable = 0;          ///< weighted squared radiance below the horizon, all channels

  int views() const { return static_cast<int>(weight.size()); }
};

/// `normal` and `tangent` are unit and perpendicular, in the fabric's frame.
TexelSamples gather_texel(const SampleLevel& level, int texel, const std::vector<V3f>& views,
                          const std::vector<V3f>& lights, const V3f& normal, const V3f& tangent);

}  // namespace selvedge
