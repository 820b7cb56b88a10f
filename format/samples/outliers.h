// Finds samples that stand out of everything around them, as those of a path tracer do that met a small
// light.
#pragma once

#include "format/samples/samples.h"

namespace selvedge {

/// A sample stands out where opacity times radiance, in a channel, is more than this many times that of every
/// neighbour, the lights and views next to its own in the grids, and than the mean over the texel. Of
/// stitches traced with two rays a texel no sample reaches a third of it (docs/fit.md).
constexpr float outlier_ratio = 20;

/// Takes the samples of one side, row by row.
class OutlierSearch {
 public:
  explicit OutlierSearch(const SamplesHeader& header)
      : side_(header.side), views_(header.views), lights_(header.lights) {}

  /// The next rows of level 0.
  void add(const SampleLevel& rows);

  /// SAMPLES_OUTLIER with the place of the sample that stands out most, and their number; or nothing.
  Issues warnings() const;

 private:
  void search_texel(const SampleLevel& rows, std::size_t texel);
  Side side_;
  DirectionGrid views_;
  DirectionGrid lights_;
  int next_row_ = 0;
  int count_ = 0;
  float largest_ratio_ = outlier_ratio;
  Error largest_;
};

}  // namespace selvedge
