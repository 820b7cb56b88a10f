// Whether a fabric has holes that can be seen: what alphaMode and the fallback go by.
#pragma once

#include "format/fabric.h"

namespace selvedge {

/// More than 0.05 % of the level is open, seen from straight above. Opacity is a mean over the area, so that
/// all levels have the same answer, and a partial fabric that of the whole, but for noise: where that
/// decides, what it decides cannot be seen. Precondition: a valid fabric (see validate) that has the level.
bool has_holes(const Fabric& fabric, int level);

}  // namespace selvedge
