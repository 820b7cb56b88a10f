// Stage "dress": attaches a fabric to materials of a garment.
//
// The material gets a reference to the fabric through SELVEDGE_materials_fabric, whose KHR_texture_transform
// scale holds the repeats per unit of the garment's raw texture coordinates (a transform that was on the
// material's old textures, as quantised garments have, is replaced, not composed).
//
// By default the core material becomes a fallback for viewers that do not know the extension (fallback.h):
// a base colour texture with the same transform and UV set, roughness 1, metallic 0, sheen, alpha mode. The
// fallback replaces the old base colour and metallic-roughness, and every KHR_materials_* lobe but
// KHR_materials_emissive_strength. The garment's mask, normal texture and base colour become members of
// the extension (garment_parts.h), which the fallback shows as far as it can.
// Emission, occlusion, extras and other extensions stay. Pictures that nothing uses any more
// leave the file.
//
// Colourways are copies of the dressed materials under the names of variants; the garment's own stay.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "converter/dress/colourways.h"
#include "converter/dress/garment_parts.h"
#include "converter/dress/unwrap.h"
#include "converter/dress/uv_scale.h"
#include "format/base/vec.h"
#include "format/fabric/fabric.h"
#include "format/gltf/document.h"
#include "format/gltf/limits.h"
#include "format/gltf/materials.h"

namespace selvedge {

/// Which materials get texture coordinates of our own (unwrap.h): those whose own are missing, cover no area
/// or are stretched beyond use (uv_scale.h) on more than a tenth of the area, unless repeats are given; or
/// all.
enum class Unwrapping { where_needed, always, never };

inline constexpr const char* run_key_member = "selvedgeRun";

struct DressOptions {
  std::vector<std::string> materials = {};  ///< these three as in MaterialChoice
  bool all_cloth = false;
  std::vector<std::string> excluded_materials = {};
  ColorOptions color_options = {};
  std::vector<Colourway> colourways = {};
  std::optional<V3f> backing = {};  ///< linear: a plain surface of this colour behind the cloth
  /// Per unit of the raw UVs, instead of the physical size; below 0 the cloth is mirrored.
  std::optional<V2d> repeats = {};
  Unwrapping unwrap = Unwrapping::where_needed;
  bool single_sided = false;  ///< keep a material that is; else its cloth has two sides
  double scale = 1;           ///< of the cloth: 2 shows stitches of twice the size
  double rotation_degrees =
      0;             ///< degrees, counter-clockwise on the cloth's face; by right angles unless it is square
  V2d offset{0, 0};  ///< in repeats
  /// The middle of a repeat lies on the middle of the front (uv_scale.h), its corner on the corner of
  /// materials which are not there.
  bool lies_once = false;
  double metres_per_unit = 1;  ///< metres for each unit of the garment's lengths, which glTF takes for metres
  std::optional<double> garment_height =
      {};  ///< metres, of the garment from top to bottom, instead of `metres_per_unit`
  std::optional<bool> embed = {};  ///< the fabric goes into the glTF; default: yes for .glb, no for .gltf
  bool has_fallback = true;
  int tex_coord = 0;          ///< 0 or 1
  SceneLimits limits = {};    ///< of the garment
  std::string run_key = {};   ///< asset.extras.selvedgeRun, if not empty
  std::string usd_path = {};  ///< also write this .usda layer and its files beside it (usd.h)
};

struct DressedMaterial {
  int index = 0;
  std::string name;
  int primitive_count = 0;  ///< in the scene with this material (or with it in a variant)
  V2d repeats{0, 0};        ///< the scale that was written
  UvSize uv_size;
  std::vector<std::string> kept_members;  ///< of the garment's material
  std::vector<std::string> replaced_members;
};

/// A copy of a dressed material for a colourway.
struct VariantMaterial {
  std::string variant;
  int index = 0;
  int base_material = 0;  ///< the material that it is a copy of
  V2d repeats{0, 0};
  std::optional<V3f> tint = {};  ///< of a colourway by colour
};

struct DressReport {
  std::vector<DressedMaterial> materials;
  std::vector<VariantMaterial> variants;
  std::map<int, UnwrapReport> unwrap_reports;  ///< by material
  Imath::Box3d bounds;                         ///< of the garment, metres, in its true size
  bool embedded = false;
  int backed_primitive_count = 0;      ///< primitives
  std::uint64_t bytes = 0;             ///< of the glTF, including an embedded fabric
  std::vector<std::string> usd_files;  ///< files of DressOptions::usd_path, the layer last
  std::vector<std::string> warnings;
  Issues issues;  ///< VARIANT_UNREACHED
};

/// Reads `garment_path` (.gltf, .glb), dresses it in the fabric and writes `output_path` (.gltf, .glb), whole
/// or not at all. The fabric is embedded or referred to.
Result<DressReport> dress(const std::string& garment_path, const std::string& fabric_path,
                          const std::string& output_path, const DressOptions& options);

struct Backing {
  V3f color{0, 0, 0};   ///< linear
  double distance = 0;  ///< metres behind the cloth
};

/// Adds to the meshes of the places copies of their primitives in a plain matt material, moved against the
/// triangles' normals, which are means where vertices lie in one point, so that nothing gapes at a seam. They
/// share all vertex data but the positions with the cloth, move with its skins and morph targets, are drawn
/// from outside alone, and have no variants. A metre is found by the area that `in_scene`, of the same
/// document, has for the places. Returns their number; throws Failure.
int add_backing(GltfDocument& document, int material, const std::set<PrimitiveIndex>& places,
                const PrimitivesInScene& in_scene, const Backing& backing);

}  // namespace selvedge
