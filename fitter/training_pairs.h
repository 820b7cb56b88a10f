// Some of the pairs of directions that a fit is trained on, as a set of pairs like the held-out ones: so both
// errors are the same measure, and over-fitting shows.
#pragma once

#include <vector>

#include "format/samples/samples.h"

namespace selvedge {

/// Takes from rows of level 0, as they come, the samples of `most` pairs of the grids' directions (of all
/// where they are fewer), drawn at random, the same for the same grids. Memory: 32 bytes per pair and texel.
class TrainingPairs {
 public:
  static constexpr int most = 128;

  explicit TrainingPairs(const SamplesHeader& header);

  /// The next rows of level 0, of the header's width, views and lights.
  void add(const SampleLevel& rows);

  /// After all rows. Noise is not known and 0.
  PairSamples finish() { return std::move(pairs_); }

 private:
  PairSamples pairs_;
  std::vector<std::size_t> cells_;  ///< of the pairs: view * lights + light, ascending
  std::size_t next_texel_ = 0;
};

/// Those of a file, read some rows at a time.
Result<PairSamples> read_training_pairs(SamplesReader& reader);

}  // namespace selvedge
