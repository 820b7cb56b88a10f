// Checks of dressed garments that bake the fallback and measure the texture coordinates again.
#pragma once

#include "format/base/error.h"
#include "format/scene/scene.h"

namespace selvedge {

/// Warnings for each material with a fabric: the mean colour of the fallback differs from the fabric's
/// directional albedo seen along the normal (GLTF_FALLBACK); repeats differ in size from the fabric's period
/// (GLTF_ADVICE; medians as in `dress`). Places are JSON pointers. Unreadable fabrics and pictures are
/// skipped, as are base colours without a texture.
Issues check_dressed(const Scene& scene);

}  // namespace selvedge
