// The view table of one channel of one texel, in closed form (Daubert et al. 2001, equation (4)).
#pragma once

#include <vector>

#include "fitter/texel_samples.h"

namespace selvedge {

struct ViewTableOptions {
  /// Pull towards 1, as a share of the mean over views of <g, g>: an entry whose lobes are almost dark says
  /// little about T, and without the pull a small residual would make it explode.
  double damping = 0.05;
  double largest = 16;  ///< no entry is beyond
};

/// T(v) = (<g, r>_v + d) / (<g, g>_v + d), weighted by opacity, d = damping * mean <g, g>; 1 where the texel
/// is a hole or everything is dark. `parameters` as in lafortune.h. Entries lie in [0, largest].
std::vector<double> fit_view_table(const TexelSamples& samples, int channel,
                                   const std::vector<double>& parameters, int lobes,
                                   const ViewTableOptions& options = {});

/// Scales the table to mean 1 over the views (weighted by opacity) and the lobes by the inverse, so that T g
/// is unchanged. Precondition: table entries are >= 0; a table of zeros is left alone.
void normalise(const TexelSamples& samples, std::vector<double>& table, std::vector<double>& parameters,
               int lobes);

}  // namespace selvedge
