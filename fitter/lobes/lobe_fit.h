// The fit of lobes and view table of one texel (Daubert et al. 2001, section 5).
#pragma once

#include <array>

#include "fitter/lobes/channel_problem.h"

namespace selvedge {

/// Fitted parameters of one channel of a texel.
struct ChannelFit {
  std::vector<double> parameters;  ///< as in lafortune.h
  std::vector<double> table;       ///< [view]; mean 1, weighted by opacity; all 1 without a view table
  double cost = 0;                 ///< squared error over views and lights above the horizon, plus penalties
};

/// Levenberg-Marquardt from a state to the nearest minimum.
void minimise(ChannelProblem& problem, ChannelState& state, double tolerance, int max_evaluations);

/// Converts a state to parameters of the fabric, unscaled and with a normalised table.
ChannelFit to_channel_fit(const TexelSamples& samples, int channel, const ChannelState& state);

/// Fits all three channels. Parameters and table are finite for any samples.
std::array<ChannelFit, 3> fit_texel(const TexelSamples& samples, const FitOptions& options);

}  // namespace selvedge
