// The materials of a garment that get a fabric.
#pragma once

#include <string>
#include <vector>

#include "format/gltf/document.h"
#include "format/scene/scene.h"

namespace selvedge {

struct MaterialChoice {
  std::vector<std::string> materials = {};           ///< names (every material of that name) or "#index"
  bool all_cloth = false;                            ///< every material that may be cloth
  std::vector<std::string> excluded_materials = {};  ///< as `materials`: not these
};

struct ChosenMaterials {
  std::vector<int> materials;                  ///< at least one
  std::vector<std::string> skipped_materials;  ///< a line for each that `all` leaves alone by its name
};

/// Gives triangles without a material a new one, "fabric".
void add_missing_material(GltfDocument& document);

/// `all` leaves alone what is no cloth. Names decide: the material's own, else the names of all of its
/// meshes, their nodes and the parents of these. Words are parts of names between digits, signs and capitals;
/// one of cloth (shirt, sofa, cotton ...) wins, unless skin or hardware follows (shirt button); a body is not
/// beside skin or hair, a leg beside velvet. Where names say nothing: glass that light passes through,
/// polished metal, flat rectangles much larger than the rest, and, beside other cloth on a
/// fifth of the area, what follows joints of head and fingers. The rest is cloth, as is the only material
/// that the scene shows, and one name of meshes does not leave a document without cloth. `scene`: of the
/// document; without triangles all materials count as shown, and nothing as large. MATERIAL_MISSING.
Result<ChosenMaterials> choose_materials(const GltfDocument& document, const Scene& scene,
                                         const MaterialChoice& choice);

}  // namespace selvedge
