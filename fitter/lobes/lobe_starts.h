// Where the search for a texel's lobes begins.
//
// The cost has many local minima; which one a search ends in depends on the directions it begins with more
// than on anything else. Here all sums of a diffuse term and lobes of a small dictionary are tried (as far as
// a beam search goes), without a table, and the best few are handed out.
#pragma once

#include <vector>

#include "fitter/lobes/channel_problem.h"

namespace selvedge {

class StartSearch {
 public:
  explicit StartSearch(const TexelSamples& samples);

  /// At most `count` starts with the given number of lobes, best first, no two with the same directions; at
  /// least one.
  std::vector<ChannelState> starts(int channel, int lobes, std::size_t count);

  /// The `count` best of all states with one more lobe, of any direction of the dictionary, judged by the
  /// problem itself.
  static std::vector<ChannelState> grown(ChannelProblem& problem, const ChannelState& from,
                                         std::size_t count);

 private:
  const float* column(std::size_t i) const { return &columns_[i * size_]; }
  double product(std::size_t a, std::size_t b);

  const TexelSamples& samples_;
  std::size_t size_ = 0;        ///< samples of a column
  std::vector<float> columns_;  ///< [entry, the diffuse term first][sample], weighted
  std::array<std::vector<float>, 3> radiance_;
  std::vector<std::vector<double>> products_;  ///< rows made when they are first asked for
};

}  // namespace selvedge
