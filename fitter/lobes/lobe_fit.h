// The fit of lobes and view table of one texel (Daubert et al. 2001, section 5).
#pragma once

#include <array>
#include <vector>

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

/// Start values of the search for a texel's lobes.
///
/// The cost has many local minima; in which one a search ends depends mostly on the directions with which it
/// begins. Here sums of a diffuse term and lobes of a small dictionary, without a table, are compared by beam
/// search, and the best few are returned.
class StartSearch {
 public:
  /// Searches for these samples, which must outlive the search, in the memory that it has.
  void set_samples(const TexelSamples& samples);

  /// At most `count` starts with the given number of lobes, best first, no two with the same directions; at
  /// least one.
  std::vector<ChannelState> starts(int channel, int lobes, std::size_t count);

  /// The `count` cheapest states with one more lobe than `state`, over all directions of the dictionary.
  static std::vector<ChannelState> with_added_lobe(ChannelProblem& problem, const ChannelState& state,
                                                   std::size_t count);

 private:
  const float* column(std::size_t i) const { return &columns_[i * size_]; }
  double product(std::size_t a, std::size_t b);

  std::size_t views_ = 0;
  std::size_t size_ = 0;        ///< of a column
  std::vector<float> columns_;  ///< [entry, the diffuse term first][sample], weighted
  std::array<std::vector<float>, 3> radiance_;
  std::vector<std::vector<double>> products_;  ///< rows are computed at their first use
};

}  // namespace selvedge
