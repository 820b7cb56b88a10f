// Garments that the window of `show` writes, by the stage "dress" of the converter.
#pragma once

#include "viewer/show/background.h"

namespace selvedge {

/// Dressed garments are files of a folder of its own, which goes with the last copy of the result. Throws
/// Failure.
GarmentWriter make_garment_writer(const SceneLimits& limits);

}  // namespace selvedge
