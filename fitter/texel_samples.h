// The samples of one texel in its own frame, ready for the fit.
#pragma once

#include <array>
#include <vector>

#include "format/samples.h"

namespace selvedge {

/// Samples whose light is above the texel's horizon, in the order of views, then lights. The others are zero
/// in the model whatever its parameters are, and so take no part in a fit. Arrays of one kind, because the
/// fit's time goes into loops over them; padded with zeros to whole groups of `lanes`, which belong to no
/// view.
struct TexelSamples {
  static constexpr std::size_t lanes = 8;

  std::vector<float> x;                        ///< l'x v'x
  std::vector<float> y;                        ///< l'y v'y
  std::vector<float> z;                        ///< l'z v'z
  std::vector<float> cosine;                   ///< l'z > 0
  std::array<std::vector<float>, 3> radiance;  ///< per colour channel
  std::vector<std::size_t> first;  ///< per view where its samples begin, then where the last view's end
  std::vector<double> weight;      ///< per view: opacity, so that a mip texel has its children's minimiser
  double unreachable = 0;          ///< weighted squared radiance below the horizon, all channels

  /// With the padding.
  std::size_t size() const { return cosine.size(); }
};

/// `normal` and `tangent` are unit and perpendicular, in the fabric's frame.
TexelSamples gather_texel(const SampleLevel& level, int texel, const std::vector<V3f>& views,
                          const std::vector<V3f>& lights, const V3f& normal, const V3f& tangent);

/// Powers and logarithms of one lobe's base, Cx x + Cy y + Cz z, over all samples of a texel.
struct LobeTerms {
  std::vector<float> base;
  std::vector<float> logarithm;  ///< 0 where the base is not positive
  std::vector<float> power;      ///< base^n; 0 where the base is not positive

  /// `lobe`: Cx, Cy, Cz, n. Relative error of the power below 1e-6 + 4e-7 n |ln base|.
  void compute(const TexelSamples& samples, const double* lobe);
};

/// rho + the sum of all lobes, without the cosine, for every sample. `parameters` as in lafortune.h.
std::vector<float> lobe_sums(const TexelSamples& samples, const std::vector<double>& parameters, int lobes);

}  // namespace selvedge
