// A swatch of a fabric by the reference evaluation: texel by texel as spec/brdf.md says, without OpenGL.
// Slow; tests hold the viewer's frame of the same swatch to it.
#pragma once

#include "format/fabric/fabric.h"
#include "format/fabric/level_options.h"
#include "format/picture/frame.h"
#include "format/scene/swatch.h"

namespace selvedge {

/// Levels and texels as the viewer chooses them from the pixel's footprint (footprint.h). The frame's values
/// do not depend on the number of threads. Preconditions: the fabric has levels, 1 <= taps <= max_taps.
Frame draw_swatch(const Fabric& fabric, const SwatchShot& shot, const LevelOptions& levels = best_levels);

}  // namespace selvedge
