// Lafortune lobes of one colour channel of one texel, by Levenberg-Marquardt (Daubert et al. 2001, section
// 5). The only place that knows Ceres.
#pragma once

#include <vector>

#include "fitter/texel_samples.h"

namespace selvedge {

struct LobeFitOptions {
  int lobes = 2;
  int max_iterations = 50;
  double max_exponent = 200;  ///< sharper than a lobe that 64 x 64 directions can show
};

/// Start of a fit for radiance of the given scale (mean radiance over mean cosine): a grey diffuse term and
/// one broad forward and one broad backward lobe by turns, a little anisotropic, the other way round in every
/// second one (the paper's ratio is not readable; ours is 0.9). [parameter_count(lobes)]
std::vector<double> start_parameters(int lobes, double scale);

/// The most that a lobe may reach anywhere, for one channel: the largest radiance over cosine (cosine taken
/// as at least 0.25: near the texel's horizon the ratio says nothing).
double peak_limit(const TexelSamples& samples, int channel);

/// Improves `parameters` (layout of lafortune.h) for one channel: minimises
///   sum_v weight_v sum_l (T_v g(l, v) - r(l, v))^2  +  a ridge on the C's
/// with rho >= 0, 1 <= n <= max_exponent and max(|Cx|, |Cy|, |Cz|)^n <= `peak`. As l and v are unit vectors
/// the base of a lobe is at most max(|Cx|, |Cy|, |Cz|): no lobe exceeds `peak` in any direction, seen or not.
/// The ridge, 1e-6 of the data's energy per unit of (C / peak^(1/n)), decides only where the data say
/// nothing: a lobe without evidence fades. Parameters stay finite whatever the data. Returns the weighted
/// squared error without the ridge.
double fit_lobes(const TexelSamples& samples, int channel, const std::vector<double>& table, double peak,
                 const LobeFitOptions& options, std::vector<double>& parameters);

}  // namespace selvedge
