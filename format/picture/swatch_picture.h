// The reference picture of a swatch, by the reference evaluation of its fabric (spec/brdf.md), without
// OpenGL. Slow; the viewer's pictures are tested against it.
#pragma once

#include "format/fabric/fabric.h"
#include "format/fabric/level_options.h"
#include "format/picture/frame.h"
#include "format/scene/swatch.h"

namespace selvedge {

/// Chooses levels and texels by the pixel's footprint (footprint.h), as the viewer does. The result does not
/// depend on the number of threads. Precondition: the fabric has levels.
Frame draw_swatch(const Fabric& fabric, const SwatchShot& shot, const LevelOptions& levels = {});

}  // namespace selvedge
