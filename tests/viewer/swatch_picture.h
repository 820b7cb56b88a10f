// The reference picture of a swatch, by the reference evaluation of its fabric (spec/brdf.md), without
// OpenGL. Slow; the viewer's pictures are tested against it.
#pragma once

#include <span>

#include "format/fabric/fabric.h"
#include "format/fabric/level_options.h"
#include "format/picture/frame.h"
#include "format/scene/lights.h"
#include "format/scene/swatch.h"

namespace selvedge {

/// A pixel on cloth: texture coordinates of its centre, and their change to the next one to the right and
/// upwards, repeats.
struct Footprint {
  V2d uv{0, 0}, right{0, 0}, up{0, 0};
};

/// Radiance times opacity, and opacity, of the texels and the yarn under a pixel; directions in the frame of
/// the fabric. Opacity needs a light.
V4f shade_pixel(const Fabric& fabric, const LevelOptions& levels, const Footprint& pixel, const V3f& view,
                std::span<const Illumination> lights);

/// Chooses levels and texels by the pixel's footprint (footprint.h), as the viewer does. The result does not
/// depend on the number of threads. Precondition: the fabric has levels.
Frame draw_swatch(const Fabric& fabric, const SwatchShot& shot, const LevelOptions& levels = {});

}  // namespace selvedge
