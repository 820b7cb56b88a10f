// Pooling of samples to the next coarser mip level (Daubert et al. 2001, section 5.1).
//
// Each of the floor(w/2) x floor(h/2) coarse texels covers an equal fraction of the cell; a fine texel is
// weighted by the area of their overlap, also for odd sizes. Opacity is the mean over the area; radiance and
// normals are weighted by opacity as well, so that holes do not contribute.
#pragma once

#include <vector>

#include "format/samples/samples.h"

namespace selvedge {

/// A fine texel of a row (or column) that a coarse texel overlaps, and its fraction of the coarse texel. The
/// fractions of a coarse texel sum to 1.
struct Overlap {
  int fine = 0;
  double fraction = 0;
};

/// The overlaps of each of `coarse` texels with `fine` texels, fine >= coarse >= 1.
std::vector<std::vector<Overlap>> texel_overlaps(int fine, int coarse);

/// Precondition: the level is larger than 1 x 1.
SampleLevel pool(const SampleLevel& fine);

/// Area means of `width` x `height` values for the texels of the next coarser level.
std::vector<V3d> pool_image(const std::vector<V3d>& values, int width, int height);

}  // namespace selvedge
