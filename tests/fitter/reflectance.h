// Measured reflectance of fabrics from files (../shared/data/reflectance), as the samples of one texel.
#pragma once

#include <string>

#include "fitter/lobes/lobe_fit.h"
#include "format/base/error.h"

namespace selvedge::test {

/// f_r (1/sr, without cosine) over a full grid of incoming and outgoing directions; isotropic.
struct Reflectance {
  std::vector<V3f> lights;  ///< incoming
  std::vector<V3f> views;   ///< outgoing
  std::vector<V3f> values;  ///< [view * lights + light]
};

/// theta_i, theta_o, dphi in degrees, then r, g, b; # comments, one line of names.
Result<Reflectance> read_reflectance(const std::string& path);

/// sqrt(sum w^2 (m - d)^2 / sum w^2 d^2) over all channels, with w = cos theta_i cos theta_o and with w = 1.
struct ReflectanceError {
  double weighted = 0;
  double unweighted = 0;
};

/// The samples of one texel whose least squares is the weighted error's: opacity is cos^2 theta_o.
TexelSamples texel_of(const Reflectance& reflectance);

/// Error of a fit without table.
ReflectanceError fit_reflectance(const Reflectance& reflectance, int lobes);

}  // namespace selvedge::test
