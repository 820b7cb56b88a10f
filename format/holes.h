// Whether a fabric has holes that can be seen: what alphaMode and the fallback go by.
#pragma once

#include "format/fabric.h"

namespace selvedge {

/// More than 0.1 % of the level's texels are less than half opaque, seen from straight above. Texels of a
/// part of a fabric are larger than the holes: there, more than 0.05 % of the whole level is open.
/// Precondition: a valid fabric (see validate) that has the level.
bool has_holes(const Fabric& fabric, int level);

}  // namespace selvedge
