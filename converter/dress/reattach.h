// Restores the fabrics of a dressed garment after a tool has dropped the extension.
//
// Optimisers such as gltfpack delete unknown extensions and all data that only these refer to, embedded
// fabrics among them. With gltfpack's -ke the materials keep their extras, which hold the mirror of the
// reference (extras_mirror.h). It gives the fabric and the UV set; the transform comes from the core
// material's base colour texture, which the optimiser has changed together with the texture coordinates.
#pragma once

#include <string>
#include <vector>

#include "format/base/error.h"
#include "format/gltf/limits.h"
#include "format/scene/scene.h"

namespace selvedge {

struct ReattachOptions {
  /// Files for mirrors whose fabric is missing: "FILE" goes to the mirror with its digest, else to that with
  /// its name (the file's without the last ending), else to the only mirror left; "NAME=FILE" goes to the
  /// mirrors of that name.
  std::vector<std::string> fabrics = {};
  SceneLimits limits = {};  ///< of the garment
};

struct ReattachedMaterial {
  int index = 0;
  std::string name;
  std::string fabric;  ///< the file, or the entry that the glTF still had
  int tex_coord = 0;
  UvTransform transform;
};

struct ReattachReport {
  std::vector<ReattachedMaterial> materials;
  std::vector<int> attached;  ///< unchanged materials that still have the extension
  int embedded = 0;           ///< number of embedded fabrics
  std::uint64_t bytes = 0;    ///< of the output
  std::vector<std::string> warnings;
};

/// Reads `input_path` (.gltf, .glb), restores the extension wherever a material has a mirror but no
/// reference, and writes `output_path`, whole or not at all. Errors: GLTF_REFERENCE with the material's place
/// if a fabric cannot be found, or with the file's name if a given file belongs to no material;
/// MATERIAL_MISSING if there is nothing to restore; GARMENT_NO_UVS if the optimiser has removed the fabric's
/// texture coordinates. A fabric with another digest than the mirror's is attached, with a warning.
Result<ReattachReport> reattach(const std::string& input_path, const std::string& output_path,
                                const ReattachOptions& options);

}  // namespace selvedge
