// Several repeats of a stitch as one.
#pragma once

#include "converter/stitch/pattern.h"

namespace selvedge {

/// The same cloth with a period of `count` times as much each way: what varies by its seed along yarns and
/// between them repeats less often. A yarn that runs through one repeat runs through `count` of them, or
/// becomes several. Precondition: a valid pattern, count >= 1.
StitchPattern repeated(const StitchPattern& pattern, int count);

}  // namespace selvedge
