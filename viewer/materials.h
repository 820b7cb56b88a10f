// Materials of the scene as the index pass wants them.
#pragma once

#include <string>
#include <vector>

#include "format/image.h"
#include "format/scene.h"
#include "viewer/geometry.h"
#include "viewer/surface_look.h"

namespace selvedge {

struct Looks {
  std::vector<SurfaceLook> looks;  ///< one per surface
  std::vector<CoreLook> core;      ///< one per surface
  std::vector<Image> images;       ///< linear
};

/// Decodes the pictures that `surfaces` need; one that cannot be read is left out with a line in `remarks`.
/// A fabric is drawn on both sides, since cloth is thin and shows its back through its holes; glTF's
/// doubleSided and alphaMode hold for the materials without one. GLTF_REFERENCE where a fabric is not among
/// the `fabrics` given.
Result<Looks> looks_of(const Scene& scene, const std::vector<Surface>& surfaces, std::size_t fabrics,
                       std::vector<std::string>& remarks);

}  // namespace selvedge
