// Stage "export": the yarn of a dressed garment as geometry, for viewers that know no fabrics.
//
// Triangles with a fabric are replaced by the tubes of its yarn: whole repeats are copies of one mesh, or of
// the same one turned (EXT_mesh_gpu_instancing); so are all stitches that a map shows by the same one;
// repeats that borders and seams cut, that a copy does not come near enough to, or that lie in the region are
// ordinary meshes. Materials are glTF's core with sheen, without specular; their texture has the plies, the
// fibres and the light within the cell, colours of copies and bent yarn the variation beyond the repeat.
// Buffers are compressed (EXT_meshopt_compression), normals quantised (KHR_mesh_quantization). Hairs and
// textures of the garment on the fabric are left out. Other triangles stay as they are; the garment is at
// rest, without animations.
#pragma once

#include <Imath/ImathBox.h>

#include <optional>
#include <string>
#include <vector>

#include "format/base/error.h"
#include "format/gltf/limits.h"

namespace selvedge {

struct ExportOptions {
  int triangle_budget = 6'000'000;          ///< that are drawn at most: copies count each
  std::optional<Imath::Box2d> region = {};  ///< texture coordinates in repeats: cells here in full detail
  SceneLimits limits = {};
};

/// The yarn of one material.
struct ExportedYarn {
  int material = 0;  ///< of the garment
  std::string name;
  std::vector<std::int64_t>
      triangles_per_copy;  ///< of a repeat, or a map's stitch in the mean; then in the region
  int copy_count = 0;
  int bent_count = 0;  ///< whole repeats or stitches
  int cut_count = 0;
  double max_gap_radii = 0,
         max_overlap_radii = 0;  ///< between neighbours, radii of yarn, at most (place_repeats.h)
  double max_turn_degrees = 0;   ///< degrees, of the surface over a repeat, at most
  double max_shear_degrees = 0;  ///< degrees, at most
};

struct ExportReport {
  std::vector<ExportedYarn> yarns;
  std::int64_t triangle_count = 0;  ///< of the yarn, as drawn
  std::uint64_t bytes = 0;
  std::vector<std::string> warnings;
};

/// Reads a dressed garment and writes `output_path` (.gltf, .glb; .usda: with point instancers, and curves in
/// the region), whole or not at all. Refuses garments without a fabric (MATERIAL_MISSING), fabrics without
/// yarn (FABRIC_UNSUPPORTED) and more repeats than the triangles suffice for (FILE_TOO_LARGE).
Result<ExportReport> export_yarn(const std::string& garment_path, const std::string& output_path,
                                 const ExportOptions& options);

}  // namespace selvedge
