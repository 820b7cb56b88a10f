// Yarn of a large repeat as copies of a few kinds of pieces: stitches with like neighbours are alike.
#pragma once

#include "format/fabric/yarns.h"

namespace selvedge {

/// The yarn in pieces that are copies of at most so many kinds: the means of the most alike pieces, by
/// k-means of their shapes and of their light; pieces begin where they were. `threads`: wales and courses, or
/// ends and picks, of the repeat: a curve along x is cut at each of the first, one along y at each of the
/// second. Unchanged where a curve is a ring, or where a file would hold too much.
YarnData find_copies(const YarnData& data, const V2f& period, const V2i& threads, int max_kinds);

}  // namespace selvedge
