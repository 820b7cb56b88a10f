// The next coarser mip level's data, pooled from the finer one's (Daubert et al. 2001, section 5.1).
//
// A coarse texel of floor(w/2) x floor(h/2) covers an equal share of the cell; a fine texel counts by the
// area that the two overlap in, which also settles odd sizes. Opacity is the plain area mean; radiance and
// normals are weighted by opacity as well, so that holes count for nothing.
#pragma once

#include <vector>

#include "format/samples/samples.h"

namespace selvedge {

/// One fine texel of a row (or column) that a coarse texel overlaps, and the share of the coarse texel that
/// it fills; the shares of one coarse texel sum to 1.
struct Overlap {
  int fine = 0;
  double share = 0;
};

/// For each of `coarse` texels the fine ones it overlaps, `fine` >= `coarse` >= 1.
std::vector<std::vector<Overlap>> overlaps(int fine, int coarse);

/// Precondition: the level is larger than 1 x 1.
SampleLevel pool(const SampleLevel& fine);

/// Rows [first, first + count) of the next level of one that is `fine_height` high, from its rows
/// `first_fine` and on. Precondition: they hold all that overlap.
SampleLevel pool_rows(const SampleLevel& fine, int first_fine, int fine_height, int first, int count);

/// Area means of a picture of `width` x `height` values, to level_size() of the next level.
std::vector<V3d> pool_image(const std::vector<V3d>& values, int width, int height);

}  // namespace selvedge
