// The fit given to Ceres plainly: what the fitter's own search is held to.
#pragma once

#include "fitter/lobes/lobe_fit.h"

namespace selvedge::test {

/// The paper's alternation: lobes by Ceres (one residual per sample, automatic derivatives through
/// lafortune.h, DENSE_QR, one thread), then the table in closed form, until the cost falls by less than the
/// tolerance. The same starts, bounds, penalties and stops as fit_texel.
std::array<ChannelFit, 3> fit_texel_plainly(const TexelSamples& samples, const LobeFitOptions& options);

}  // namespace selvedge::test
