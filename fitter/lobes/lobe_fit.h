// The fit of lobes and view table of one texel (Daubert et al. 2001, section 5).
#pragma once

#include <array>

#include "fitter/lobes/channel_problem.h"

namespace selvedge {

struct LobeFitOptions {
  ChannelOptions channel;
  int lobes = 2;
  int starts = 3;           ///< short searches
  int finalists = 1;        ///< the best of the starts, which are continued to the end
  int max_iterations = 60;  ///< of each search
  /// A search ends if an iteration lowers the cost by less than this fraction, or the next one is expected
  /// to.
  double tolerance = 1e-4;
};

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
std::array<ChannelFit, 3> fit_texel(const TexelSamples& samples, const LobeFitOptions& options);

}  // namespace selvedge
