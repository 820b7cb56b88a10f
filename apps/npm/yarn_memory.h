// Yarns at rest, which the host remembers: a page makes cloth of the same yarns many times.
#pragma once
#include "converter/stitch/yarn_relax.h"

namespace selvedge {

/// relax(), or the host's memory of it. What the host does not remember it gets: a digest of all that relax()
/// reads, and all that that changed.
RelaxResult relaxed_once(const StitchPattern& pattern, const RelaxOptions& options);
/// The same for a preview: what the host does not remember roughly, of large knits as an edit of the last one
/// of the same gauge, and as if there were room.
RelaxResult relaxed_roughly(const StitchPattern& pattern, const RelaxOptions& options);

}  // namespace selvedge
