// A random subset of the pairs of directions that a fit uses, in the form of the held-out pairs: their errors
// are the same measure, so that over-fitting shows.
#pragma once

#include <vector>

#include "format/samples/samples.h"

namespace selvedge {

/// Collects, from rows of level 0, the samples of `max_pairs` random pairs of the grids' directions (of all
/// pairs if there are fewer). The same grids give the same pairs. Memory: 32 bytes per pair and texel.
class TrainingPairs {
 public:
  static constexpr int max_pairs = 128;

  explicit TrainingPairs(const SamplesHeader& header);

  /// The next rows of level 0, of the header's width, views and lights.
  void add(const SampleLevel& rows);

  /// To be called after all rows. Noise is unknown and 0.
  PairSamples finish() { return std::move(pairs_); }

 private:
  PairSamples pairs_;
  std::vector<std::size_t> cells_;  ///< view * lights + light of each pair, ascending
  std::size_t next_texel_ = 0;
};

/// The training pairs of a file, read some rows at a time.
Result<PairSamples> read_training_pairs(SamplesReader& reader);

}  // namespace selvedge
