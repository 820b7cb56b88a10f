#include "converter/export/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "converter/dress/fabric_source.h"
#include "converter/dress/fallback.h"
#include "converter/dress/usd.h"
#include "converter/export/place_repeats.h"
#include "converter/make/fallback_factors.h"
#include "format/base/option_text.h"
#include "format/fabric/file.h"
#include "format/gltf/edit.h"
#include "format/gltf/names.h"
#include "format/gltf/pose.h"
#include "format/gltf/read_scene.h"
#include "format/gltf/unused_parts.h"

namespace selvedge {
namespace {

/// A fabric's yarn, and the surface that wears it.
struct WornCloth {
  int material = 0;
  std::string name;
  V3f tint{1, 1, 1};
  Fabric fabric;
  Cloth cloth;
  V3d origin{0, 0, 0};                 ///< m, world: of the cloth's positions
  V2d cell_counts{1, 1};               ///< of a repeat: the map's stitches (repeat_mesh.h)
  std::optional<Imath::Box2d> region;  ///< in cells
  std::vector<ClothCell> cells;
  std::vector<int> detail;  ///< of each cell: 1 in the region, else 0

  const Yarns& yarns() const { return *fabric.levels.front().yarns(); }
};

constexpr double pixels_of_yarn = 1 << 14, pixels_in_region = 1 << 16;  ///< of a repeat's picture
constexpr double pixels_of_map = 4;                                     ///< as many times as many

/// Moves the cloth's positions to their origin (origin_of()), which it returns.
V3d move_to_origin(Cloth& cloth) {
  Imath::Box3d box;
  for (const Cloth::Triangle& t : cloth.triangles)
    for (const Cloth::Corner& corner : t.corners) box.extendBy(corner.position);
  const V3d origin = origin_of(box);
  for (Cloth::Triangle& t : cloth.triangles)
    for (Cloth::Corner& corner : t.corners) corner.position -= origin;
  return origin;
}

/// Values in whole steps of a power of two, which meshopt packs well, by the bits of the largest.
std::vector<float> in_steps(std::span<const float> values, int bits) {
  int exponent = 0;
  float largest = 0;
  for (const float value : values) largest = std::max(largest, std::abs(value));
  std::frexp(largest, &exponent);
  std::vector<float> rounded;
  for (const float value : values)
    rounded.push_back(std::ldexp(std::round(std::ldexp(value, bits - exponent)), exponent - bits));
  return rounded;
}

class Exporter {
 public:
  /// `curves`: gets the yarn in the region, which is a mesh if that is null.
  Exporter(GltfDocument& document, const ExportOptions& options, std::vector<UsdCurves>* curves)
      : document_(document), options_(options), curves_(curves) {}

  ExportReport run() {
    const UsedParts used = used_parts(document_);
    const Scene scene = value_or_throw(read_scene(document_, options_.limits));
    report_.warnings = scene.remarks;
    read_cloths(scene);
    const std::array<double, 2> triangles = divide_triangles();
    remove_surfaces();
    document_.original_encoding.required_extensions = {names::gltf::meshopt, names::gltf::khr_meshopt};
    for (const WornCloth& worn : cloths_) add(worn, triangles);
    drop_unused_parts(document_, used);
    return std::move(report_);
  }

 private:
  [[noreturn]] void refuse(Code code, std::string place, std::string why) const {
    throw Failure{{code, document_.file, std::move(place), std::move(why)}};
  }

  void read_cloths(const Scene& scene) {
    std::uint64_t memory = scene.memory_left;
    for (int m = 0; m < static_cast<int>(scene.materials.size()); ++m) {
      const SceneMaterial& material = scene.materials[m];
      const std::string place = fmt::format("/materials/{}", m);
      if (!material.fabric || std::ranges::none_of(scene.instances, [&](const SceneInstance& instance) {
            return scene.primitives[instance.primitive].material == m;
          }))
        continue;
      const SceneFabric& source = scene.fabrics[material.fabric->fabric];
      FabricReader reader = value_or_throw(
          source.path.empty() ? FabricReader::open(source.bytes, source.name, {.memory = memory})
                              : FabricReader::open(source.path, {.memory = memory}));
      Fabric fabric = value_or_throw(reader.read());
      memory -= std::min(memory, reader.peak_memory_bytes());
      if (!fabric.levels.front().yarns())
        refuse(Code::fabric_unsupported, place,
               fmt::format("the fabric {} has texels alone, no yarn", source.name));
      if (material.fabric->tex_coord > 1)
        refuse(Code::garment_no_uvs, place, "only the UV sets 0 and 1 are read");
      WornCloth& worn = cloths_.emplace_back();
      worn.material = m;
      worn.name = material.name.empty() ? fmt::format("material {}", m) : material.name;
      worn.tint = material.garment_textures.tint;
      worn.fabric = std::move(fabric);
      if (const YarnMap* const map = worn.fabric.find_map()) worn.cell_counts = V2d(map->size);
      worn.cloth = cloth_of(scene, m, worn.cell_counts);
      worn.origin = move_to_origin(worn.cloth);
      if (worn.cloth.triangles.empty())
        refuse(Code::garment_no_uvs, place, "its texture coordinates cover no area in the scene");
      for (const auto& [texture, what] :
           {std::pair(&material.garment_textures.mask, "mask"),
            std::pair(&material.garment_textures.normal, "normal texture"),
            std::pair(&material.garment_textures.tint_texture, "texture of the tint")})
        if (texture->image >= 0)
          report_.warnings.push_back(fmt::format("{}: the {} is left out", worn.name, what));
      if (std::ranges::any_of(scene.primitives,
                              [&](const ScenePrimitive& p) { return p.material == m && !p.colors.empty(); }))
        report_.warnings.push_back(worn.name + ": the vertex colours are left out");
    }
    if (cloths_.empty()) refuse(Code::material_missing, "/materials", "no surface wears a fabric");
  }

  /// Finds the cells, and divides the triangles: a repeat outside of the region gets so many, and one within
  /// it all that show, as far as half of them suffices.
  std::array<double, 2> divide_triangles() {
    const double allowed = options_.triangle_budget;
    const auto refuse_if_over = [&](double count, double least) {
      if (least <= allowed) return;
      refuse(Code::file_too_large, "",
             fmt::format("{:.0f} copies of yarn need {:.0f} triangles, more than {}; --triangles allows "
                         "more, and a larger repeat (dress --scale) needs fewer",
                         count, least, options_.triangle_budget));
    };
    double repeats = 0, least = 0;
    for (const WornCloth& worn : cloths_) {
      repeats += worn.cloth.uv_area;
      least += worn.cloth.uv_area * min_triangles(worn.yarns());
    }
    refuse_if_over(repeats, least);
    std::array<double, 2> counts{};
    double full = 0;
    least = 0;
    for (WornCloth& worn : cloths_) {
      if (options_.region)
        worn.region = {options_.region->min * worn.cell_counts, options_.region->max * worn.cell_counts};
      auto cells = cells_of(worn.cloth, yarn_uv_bounds(worn.yarns()), allowed);
      if (!cells)
        refuse(
            Code::file_too_large, fmt::format("/materials/{}", worn.material),
            fmt::format("its texture coordinates reach over more than {} repeats", options_.triangle_budget));
      worn.cells = std::move(*cells);
      if (const YarnMap* const map = worn.fabric.find_map())
        for (ClothCell& cell : worn.cells) cell.stitch = map->shown_at(cell.repeat_index);
      full = std::max(full, max_triangles(worn.yarns()));
      least = std::max(least, min_triangles(worn.yarns()));
      for (const ClothCell& cell : worn.cells) {
        worn.detail.push_back(worn.region && worn.region->intersects(V2d(cell.repeat_index) + V2d(0.5, 0.5)));
        counts[worn.detail.back()] += 1;
      }
    }
    if (options_.region && counts[1] == 0) report_.warnings.emplace_back("the region has none of the cloth");
    const double within =
        counts[1] > 0 ? std::min(full, (counts[0] > 0 ? allowed / 2 : allowed) / counts[1]) : full;
    const double outside =
        counts[0] > 0 ? std::min(full, (allowed - within * counts[1]) / counts[0]) : within;
    if (std::min(within, outside) < least)
      refuse_if_over(counts[0] + counts[1],
                     (counts[0] + counts[1]) * least * (counts[0] > 0 && counts[1] > 0 ? 2 : 1));
    return {outside, within};
  }

  void add(const WornCloth& worn, const std::array<double, 2>& triangles) {
    std::vector<RepeatMesh> meshes;
    const double more = worn.fabric.find_map() != nullptr ? pixels_of_map : 1;
    for (int detail = 0; detail <= std::ranges::max(worn.detail); ++detail)
      meshes.push_back(mesh_of_repeat(worn.yarns(), std::min(triangles[detail], max_triangles(worn.yarns())),
                                      more * (detail == 0 ? pixels_of_yarn : pixels_in_region)));
    const RepeatFrame frame{V2d(cell_size(worn.yarns())), worn.fabric.reference_height};

    const LaidCloth laid =
        place_repeats(worn.cloth, worn.cells, worn.yarns(), frame, meshes, worn.detail, worn.region);
    constexpr double degrees = 180 / std::numbers::pi;
    ExportedYarn yarn{.material = worn.material,
                      .name = worn.name,
                      .triangles_per_copy = {},
                      .max_gap_radii = laid.max_gap_radii,
                      .max_overlap_radii = laid.max_overlap_radii,
                      .max_turn_degrees = laid.max_turn * degrees,
                      .max_shear_degrees = laid.max_shear * degrees};
    for (std::size_t d = 0; d < meshes.size(); ++d) {
      const PlacedRepeats& placed = laid.repeats[d];
      const std::vector<int> materials = add_materials(worn, meshes[d], d == 0);
      yarn.triangles_per_copy.push_back(mesh_triangle_count(meshes[d]));
      yarn.bent_count += placed.bent_repeat_count;
      yarn.cut_count += placed.cut_repeat_count;
      const std::string name = worn.name + (d == 0 ? " yarn" : " yarn in the region");
      for (const auto& [shape, copies] : placed.copies) {
        std::vector<TubeMesh> tubes;
        for (const MergedTubes& one : meshes[d].tubes_of(shape.stitch)) {
          tubes.push_back(shaped_mesh(one.mesh, shape, frame));
          report_.triangle_count +=
              static_cast<std::int64_t>(tubes.back().indices.size() / 3 * copies.size());
        }
        add_copies(name, add_mesh(name, tubes, materials), copies, worn.origin);
        yarn.copy_count += static_cast<int>(copies.size());
      }
      if (d > 0 && curves_ != nullptr && worn.fabric.find_map() == nullptr) {
        add_curves(worn, laid, name);
        continue;
      }
      std::int64_t bent = 0;
      for (const TubeMesh& one : placed.bent_meshes)
        bent += static_cast<std::int64_t>(one.indices.size() / 3);
      report_.triangle_count += bent;
      if (bent > 0)
        add_node(
            {{"name", name + ", bent"}, {"mesh", add_mesh(name + ", bent", placed.bent_meshes, materials)}},
            worn.origin);
    }
    report_.yarns.push_back(std::move(yarn));
  }

  void add_curves(const WornCloth& worn, const LaidCloth& laid, const std::string& name) {
    const double scale = std::sqrt(worn.cloth.area / worn.cloth.uv_area /
                                   (V2d(worn.yarns().period()).x * V2d(worn.yarns().period()).y));
    for (std::size_t c = 0; c < laid.region_lines.size(); ++c) {
      const YarnCurve& curve = worn.yarns().data().curves[c];
      const float width = 2 * ply_or_yarn_radius(curve) * static_cast<float>(scale);
      if (!laid.region_lines[c].empty())
        curves_->push_back({name, curve.albedo * worn.tint, width, laid.region_lines[c], worn.origin});
    }
  }

  /// Core materials of the yarns with the picture; the first may stand in the garment's place.
  std::vector<int> add_materials(const WornCloth& worn, const RepeatMesh& mesh, bool in_place) {
    const auto json_of = [](const V3f& x) { return Json::array({x.x, x.y, x.z}); };
    V3f white(0, 0, 0);
    Image picture = mesh.picture;
    const auto each_value = [&](const auto& change) {
      for (std::size_t i = 0; i < picture.pixels.size(); ++i)
        change(picture.pixels[i], white[static_cast<int>(i % 3)]);
    };
    each_value([](float value, float& most) { most = std::max(most, std::min(value, 1.0F)); });
    each_value([](float& value, float most) { value = most > 0 ? std::min(value / most, 1.0F) : 0; });
    Json core{{"baseColorFactor", json_of(white * worn.tint)},
              {"baseColorTexture",
               {{"index", value_or_throw(add_color_texture(document_, picture, "light of the yarn"))}}},
              {"metallicFactor", 0}};
    core["baseColorFactor"].push_back(1);
    Json material{{"name", worn.name + " yarn"}, {"pbrMetallicRoughness", std::move(core)}};
    material["extensions"]["KHR_materials_specular"] = {{"specularFactor", 0}};
    list_extension(document_.json, "KHR_materials_specular");
    const FallbackFactors factors = fallback_of(worn.fabric);
    if (factors.sheen_color != V3f(0, 0, 0)) {
      material["extensions"]["KHR_materials_sheen"] = {
          {"sheenColorFactor", json_of(factors.sheen_color * worn.tint)},
          {"sheenRoughnessFactor", factors.sheen_roughness}};
      list_extension(document_.json, "KHR_materials_sheen");
    }
    Json& materials = document_.json["materials"];
    std::vector<int> numbers;
    for (std::size_t y = 0; y < mesh.tubes_of(0).size(); ++y) {
      numbers.push_back(in_place && y == 0 ? worn.material : append(materials, material));
      if (in_place && y == 0) materials[worn.material] = material;
    }
    return numbers;
  }

  void set_values(Json& attributes, const char* semantic, std::span<const float> values, int components,
                  int bits, bool bounds = false) {
    attributes[semantic] = append_float_accessor(document_, in_steps(values, bits), components, bounds);
  }

  /// Nothing where all are 1.
  void set_shades(Json& attributes, const char* semantic, const std::vector<float>& shades, int bits) {
    if (std::ranges::all_of(shades, [](float shade) { return shade == 1; })) return;
    std::vector<V3f> colors;
    for (const float shade : shades) colors.emplace_back(shade);
    set_values(attributes, semantic, floats_of(colors), 3, bits);
  }

  int add_mesh(const std::string& name, const std::vector<TubeMesh>& tubes,
               const std::vector<int>& materials) {
    Json primitives = Json::array();
    for (std::size_t y = 0; y < tubes.size(); ++y) {
      const TubeMesh& mesh = tubes[y];
      if (mesh.indices.empty()) continue;
      Json attributes;
      set_values(attributes, "POSITION", floats_of(mesh.positions), 3, 16, true);  // 1/30 mm in a metre
      attributes["NORMAL"] = append_accessor(document_, floats_of(mesh.normals), {0, 3, 5120, true});
      set_values(attributes, "TEXCOORD_0", floats_of(mesh.tex_coords), 2, 10);
      set_shades(attributes, "COLOR_0", mesh.shades, 6);
      primitives.push_back({{"attributes", std::move(attributes)},
                            {"indices", append_index_accessor(document_, mesh.indices)},
                            {"material", materials[y]}});
    }
    require_extension(document_.json, "KHR_mesh_quantization");
    return append(document_.json["meshes"], {{"name", name}, {"primitives", std::move(primitives)}});
  }

  void add_copies(const std::string& name, int mesh, const std::vector<RepeatCopy>& copies,
                  const V3d& origin) {
    std::vector<V3f> translations, scales;
    std::vector<V4f> rotations;
    std::vector<float> shades;
    for (const RepeatCopy& copy : copies) {
      translations.push_back(copy.translation);
      rotations.push_back(copy.rotation);
      scales.push_back(copy.scale);
      shades.push_back(copy.shade);
    }
    Json attributes;
    set_values(attributes, "TRANSLATION", floats_of(translations), 3, 17);
    set_values(attributes, "ROTATION", floats_of(rotations), 4, 12);
    set_values(attributes, "SCALE", floats_of(scales), 3, 12);
    set_shades(attributes, "_COLOR_0", shades, 8);
    Json node{{"name", name}, {"mesh", mesh}};
    node["extensions"][names::gltf::gpu_instancing]["attributes"] = std::move(attributes);
    require_extension(document_.json, names::gltf::gpu_instancing);
    add_node(std::move(node), origin);
  }

  void add_node(Json node, const V3d& origin) {
    if (origin != V3d(0, 0, 0)) node["translation"] = {origin.x, origin.y, origin.z};
    Json& root = document_.json;
    Json& scene = root["scenes"][std::max(0, index_of(member(root, "scene")))];
    scene["nodes"].push_back(append(root["nodes"], std::move(node)));
  }

  /// The triangles that wore the cloths, and all other use of fabrics.
  void remove_surfaces() {
    Json& root = document_.json;
    if (array_member(root, "scenes").empty()) {
      const NodeTransforms transforms(document_);
      Json& nodes = root["scenes"][0]["nodes"];
      for (int i = 0; i < static_cast<int>(root["nodes"].size()); ++i)
        if (!transforms.has_parent(i)) nodes.push_back(i);
    }
    bool moved = root.erase("animations") > 0;
    for (int m = static_cast<int>(root["meshes"].size()) - 1; m >= 0; --m) {
      Json rest = Json::array();
      for (Json& primitive : root["meshes"][m]["primitives"]) {
        const int material = index_of(member(primitive, "material"));
        if (std::ranges::find(cloths_, material, &WornCloth::material) == cloths_.end())
          rest.push_back(std::move(primitive));
      }
      root["meshes"][m]["primitives"] = std::move(rest);
      if (!root["meshes"][m]["primitives"].empty()) continue;
      root["meshes"].erase(m);
      for (Json& node : root["nodes"]) {
        const int own = index_of(member(node, "mesh"));
        if (own > m) node["mesh"] = own - 1;
        if (own != m) continue;
        moved = moved || node.contains("skin");
        for (const char* key : {"mesh", "skin", "weights"}) node.erase(key);
        if (node.contains("extensions")) erase_extension(node, names::gltf::gpu_instancing);
      }
    }
    if (moved) report_.warnings.emplace_back("the yarn is at rest: animations and skins are left out");
    const auto forget = [](Json& owner) {
      if (member(owner, "extensions").is_object()) erase_extension(owner, names::gltf::fabric_extension);
    };
    forget(root);
    for (Json& material : root["materials"]) forget(material);
    unlist_extension(root, names::gltf::fabric_extension);
  }

  GltfDocument& document_;
  const ExportOptions& options_;
  std::vector<UsdCurves>* curves_;
  std::vector<WornCloth> cloths_;
  ExportReport report_;
};

}  // namespace

Result<ExportReport> export_yarn(const std::string& garment_path, const std::string& output_path,
                                 const ExportOptions& options) {
  return result_of_edit(garment_path, [&] {
    GltfDocument document = load_garment(garment_path, output_path, options.limits.document);
    std::vector<UsdCurves> curves;
    const bool is_usd = has_ending(output_path, ".usda");
    ExportReport report = Exporter(document, options, is_usd ? &curves : nullptr).run();
    if (!is_usd) {
      report.bytes = value_or_throw(save_gltf(std::move(document), output_path));
      return report;
    }
    const UsdFiles files = value_or_throw(usd_of(document, output_path, options.limits, curves));
    report.warnings.insert(report.warnings.end(), files.remarks.begin(), files.remarks.end());
    for (const UsdFile& file : files.files) report.bytes += file.bytes.size();
    value_or_throw(commit_all(stage_files(files)));
    return report;
  });
}

}  // namespace selvedge
