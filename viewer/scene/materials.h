// Converts the materials of a scene for drawing.
#pragma once

#include <string>
#include <vector>

#include "format/picture/image.h"
#include "format/scene/scene.h"
#include "viewer/scene/material.h"
#include "viewer/scene/surfaces.h"

namespace selvedge {

struct Materials {
  std::vector<SurfaceMaterial> surfaces;  ///< one per surface
  std::vector<PbrMaterial> pbr;           ///< one per surface
  std::vector<Image> images;              ///< linear
};

/// Decodes the pictures that `surfaces` need; unreadable ones are skipped with a line in `remarks`. Fabrics
/// are drawn on both sides, since cloth is thin and its back shows through holes; doubleSided applies to
/// materials without a fabric. GLTF_REFERENCE if a fabric is not among the `fabrics` given.
Result<Materials> materials_of(const Scene& scene, const std::vector<Surface>& surfaces, std::size_t fabrics,
                               std::vector<std::string>& remarks);

}  // namespace selvedge
