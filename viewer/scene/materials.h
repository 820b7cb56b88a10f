// Materials of the scene as the index pass wants them.
#pragma once

#include <string>
#include <vector>

#include "format/picture/image.h"
#include "format/scene/scene.h"
#include "viewer/scene/material.h"
#include "viewer/scene/surfaces.h"

namespace selvedge {

struct Materials {
  std::vector<SurfaceMaterial> surfaces;  ///< how each surface is drawn
  std::vector<PbrMaterial> pbr;           ///< one per surface
  std::vector<Image> images;              ///< linear
};

/// Decodes the pictures that `surfaces` need; one that cannot be read is left out with a line in `remarks`.
/// A fabric is drawn on both sides, since cloth is thin and shows its back through its holes; glTF's
/// doubleSided and alphaMode hold for the materials without one. GLTF_REFERENCE where a fabric is not among
/// the `fabrics` given.
Result<Materials> materials_of(const Scene& scene, const std::vector<Surface>& surfaces, std::size_t fabrics,
                               std::vector<std::string>& remarks);

}  // namespace selvedge
