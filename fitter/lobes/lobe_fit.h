// Lobes and view table of one texel, by a search of our own (Daubert et al. 2001, section 5).
#pragma once

#include <array>
#include <span>

#include "fitter/lobes/channel_problem.h"

namespace selvedge {

struct LobeFitOptions {
  ChannelOptions channel;
  int lobes = 2;
  int starts = 3;           ///< searches that go a little way
  int finalists = 1;        ///< the best of them, which go to the end
  int max_iterations = 60;  ///< of each search
  /// A search ends where an iteration lowers the cost by less than this share, and where the next one is
  /// expected to.
  double tolerance = 1e-4;
};

/// One channel of one texel, fitted.
struct ChannelFit {
  std::vector<double> parameters;   ///< as in lafortune.h
  std::vector<double> table;        ///< [view]; mean 1, weighted by opacity; without a table all 1
  std::vector<double> light_table;  ///< [light]; mean 1; empty without one
  double error = 0;                 ///< sum over views and lights above the horizon of w (f - r)^2
  double cost = 0;                  ///< the error and the penalties
  double energy = 0;                ///< sum of w r^2
  int iterations = 0;
  bool converged = false;
};

struct SearchEnd {
  int evaluations = 0;     ///< of all samples
  bool converged = false;  ///< ended by the tolerance
};

/// Levenberg-Marquardt from a state to the nearest minimum.
SearchEnd minimise(ChannelProblem& problem, ChannelState& state, double tolerance, int max_evaluations);

/// A state in the parameters of the fabric, unscaled and with the table normalised.
ChannelFit channel_fit(const TexelSamples& samples, int channel, const ChannelState& state,
                       const ChannelProblem& problem);

/// The inverse of channel_fit(): lobes of no size have lost their directions.
ChannelState state_of(const TexelSamples& samples, int channel, const ChannelFit& fit);

/// All three channels. Parameters and table are finite whatever the data.
std::array<ChannelFit, 3> fit_texel(const TexelSamples& samples, const LobeFitOptions& options);

/// The same from the fit of the texel in a frame near, or without a light table: one search a channel.
std::array<ChannelFit, 3> refit_texel(const TexelSamples& samples, const std::array<ChannelFit, 3>& near,
                                      const LobeFitOptions& options);

}  // namespace selvedge
