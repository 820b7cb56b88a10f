// Whether a fabric has holes that can be seen: what alphaMode and the fallback go by.
#pragma once

#include "format/fabric/fabric.h"

namespace selvedge {

/// More than 0.05 % of the level is open, seen from straight above. Opacity is a mean over the area, so that
/// all levels without slabs have the same answer, and a partial fabric that of the whole, but for noise and
/// the steps of half precision; where these decide it is about 0.05 % of what shows through. Slabs of coarser
/// levels are made anew and open by some percent more or less. Precondition: a valid fabric (see validate)
/// that has the level.
bool has_holes(const Fabric& fabric, int level);

}  // namespace selvedge
