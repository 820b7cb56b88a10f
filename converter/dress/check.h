// Checks of dressed garments that need the fallback baked and the texture coordinates measured again.
#pragma once

#include "format/base/error.h"
#include "format/scene/scene.h"

namespace selvedge {

/// Warnings for each material with a fabric: a fallback whose mean colour is not that of the fabric's
/// directional albedo seen along the normal (GLTF_FALLBACK), and repeats that are not of the size which the
/// fabric says that it has (GLTF_ADVICE; medians as `dress` takes them). Places are JSON pointers. Fabrics
/// and pictures that cannot be read are left out, as are base colours that have no texture.
Issues check_dressed(const Scene& scene);

}  // namespace selvedge
