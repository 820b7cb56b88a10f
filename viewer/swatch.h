// Makes a scene of a flat swatch, viewed without perspective texel by texel (swatches of
// format/scene/swatch.h have perspective).
#pragma once

#include "format/fabric/fabric.h"
#include "format/scene/camera.h"
#include "format/scene/scene.h"

namespace selvedge {

struct SwatchOptions {
  V2i repeats{1, 1};
  /// Pixels per texel of `level` along both sides; 0.5 gives one pixel for two texels. The frame's size is
  /// rounded to whole pixels, at least one.
  double pixels_per_texel = 1;
  int level = -1;     ///< of the whole fabric; -1: the finest level's size, footprints select the level
  V3d view{0, 0, 1};  ///< towards the viewer, in the fabric's frame, z > 0; any length
};

struct Swatch {
  Scene scene;  ///< a quad in the plane z = 0, u along x, falling v along y; fabric 0 is the swatch's
  Camera
      camera;  ///< parallel; its image plane is the cloth, so that every view has the same texels in a pixel
  int width = 0;
  int height = 0;
};

/// With one pixel per texel of a level, pixel (x, y) shows texel (x, y) of that level (repeating).
/// OPTION_OUT_OF_RANGE for options, also for a level that the fabric does not have.
Result<Swatch> make_swatch(const Fabric& fabric, const SwatchOptions& options);

}  // namespace selvedge
