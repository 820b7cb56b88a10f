// Fabrics are put back on a dressed garment whose extension a tool has dropped.
//
// Optimisers such as gltfpack delete extensions that they do not know, and what only those referred to: an
// embedded fabric is gone. With gltfpack's -ke the materials keep their extras, and in them the mirror of the
// reference (mirror.h). From it come the fabric and the UV set; the transform comes from the core material's
// base colour texture, because the optimiser has changed that one together with the texture coordinates.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "format/base/error.h"
#include "format/scene/scene.h"

namespace selvedge {

struct ReattachOptions {
  /// Fabric files for mirrors whose fabric is not there: "FILE", which goes to the mirror with its digest,
  /// else to the one with its name (the file's without the last ending), else to the only one that is left;
  /// or "NAME=FILE" for the mirrors of that name.
  std::vector<std::string> fabrics = {};
  std::optional<bool> embed = {};  ///< fabrics inside of the glTF; as it is: those that were
};

struct ReattachedMaterial {
  int index = 0;
  std::string name;
  std::string fabric;  ///< the file, or the entry of the glTF that was still there
  int tex_coord = 0;
  UvTransform transform;
};

struct ReattachReport {
  std::vector<ReattachedMaterial> materials;
  std::vector<int> attached;  ///< materials that have the extension and were left alone
  int embedded = 0;           ///< fabrics that were
  std::uint64_t bytes = 0;    ///< written
  std::vector<std::string> warnings;
};

/// Reads `input_path` (.gltf, .glb), restores the extension wherever a material has a mirror but no
/// reference, and writes `output_path`, whole or not at all. GLTF_REFERENCE with the material's place where a
/// fabric cannot be found, and with the file's name where one that is given belongs to no material;
/// MATERIAL_MISSING where there is nothing to restore; GARMENT_NO_UVS where the optimiser has removed the
/// fabric's texture coordinates. A fabric of another digest than the mirror's is attached, with a warning.
Result<ReattachReport> reattach(const std::string& input_path, const std::string& output_path,
                                const ReattachOptions& options);

}  // namespace selvedge
