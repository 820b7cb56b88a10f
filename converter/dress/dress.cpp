#include "converter/dress/dress.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <set>

#include "converter/dress/add_tangents.h"
#include "converter/dress/choose_materials.h"
#include "converter/dress/extras_mirror.h"
#include "converter/dress/fabric_source.h"
#include "converter/dress/fallback.h"
#include "converter/dress/fallback_material.h"
#include "converter/dress/garment_parts.h"
#include "converter/dress/usd.h"
#include "format/base/guard.h"
#include "format/base/option_text.h"
#include "format/fabric/file.h"
#include "format/gltf/access.h"
#include "format/gltf/document.h"
#include "format/gltf/fabric_extension.h"
#include "format/gltf/geometry.h"
#include "format/gltf/material_uses.h"
#include "format/gltf/names.h"
#include "format/gltf/read_scene.h"
#include "format/gltf/unused_pictures.h"
#include "format/gltf/uri.h"

namespace selvedge {
namespace {

std::string name_of(const Json& material) { return string_of(member(material, "name")); }

class Dresser {
 public:
  Dresser(GltfDocument& document, const Fabric& fabric, const DressOptions& options)
      : document_(document), fabric_(fabric), options_(options) {}

  DressReport dress(const FabricSource& source, const std::string& digest) {
    digest_ = digest;
    const ChosenMaterials chosen =
        must(choose_materials(document_, {options_.materials, options_.all, options_.except}));
    report_.warnings = chosen.left_alone;
    std::set<int> textures = textures_in_use(document_.json);
    const Scene scene = must(read_scene(document_, options_.limits));
    for (const std::string& remark : scene.remarks) report_.warnings.push_back(remark);
    report_.bounds = bounds_of(scene);
    if (const std::string remark = judge_size(report_.bounds); !remark.empty())
      report_.warnings.push_back(remark);
    uses_ = uses_of(document_.json);
    const int index = must(add_fabric(document_, source));
    std::optional<Error> left_out;
    for (const int material : chosen.materials) {
      try {
        must(dress(material, index, scene));
      } catch (const Failure& failure) {
        // `all` skips materials that cannot be dressed; named ones must be dressed.
        if (!options_.all || failure.error.code != Code::garment_no_uvs) throw;
        report_.warnings.push_back(
            fmt::format("material #{} was left alone: {}", material, failure.error.message));
        if (!left_out) left_out = failure.error;
      }
    }
    if (report_.materials.empty()) {
      throw Failure{left_out.value_or(
          Error{Code::garment_empty, document_.file, "/materials", "the materials are on no triangles"})};
    }
    if (textures_) {
      textures.insert(textures_->base_color);
      if (textures_->normal >= 0) textures.insert(textures_->normal);
    }
    if (const std::string unknown = drop_unused_pictures(document_, textures); !unknown.empty()) {
      report_.warnings.push_back(
          fmt::format("pictures that nothing uses any more stay in the file: {} may refer to them", unknown));
    }
    report_.embedded = source.uri.empty();
    return std::move(report_);
  }

 private:
  Result<void> dress(int material, int fabric, const Scene& scene) {
    const std::set<Place>& places = uses_[material];
    DressedMaterial dressed;
    dressed.index = material;
    dressed.name = name_of(document_.json["materials"][material]);
    const std::string where = fmt::format("material #{} \"{}\"", material, dressed.name);
    if (places.empty()) {
      report_.warnings.push_back(where + " is on no triangles and was left alone");
      return {};
    }
    if (Result<void> good = check_uvs(document_, places, options_.tex_coord); !good) return good;

    std::set<int> primitives;
    for (int i = 0; i < static_cast<int>(scene.primitives.size()); ++i) {
      const ScenePrimitive& primitive = scene.primitives[i];
      if (places.contains(Place(primitive.mesh, primitive.index))) primitives.insert(i);
    }
    const UvSize size = measure_uv(scene, primitives, options_.tex_coord);
    dressed.primitives = size.primitives;
    dressed.size = size;
    const V2d period = options_.mm_per_repeat.value_or(V2d(fabric_.period_mm)) * options_.scale;
    // A cloth that lies on its side has its courses along v.
    const bool on_side = std::lround(options_.rotation / 90) % 2 != 0;
    for (int c = 0; c < 2; ++c) {
      dressed.repeats[c] =
          options_.repeats ? (*options_.repeats)[c] : size.metres[c] * 1000.0 / period[on_side ? 1 - c : c];
    }
    if (!(dressed.repeats.x > 0) || !(dressed.repeats.y > 0)) {
      return fail(Code::garment_no_uvs, document_.file, fmt::format("/materials/{}", material),
                  fmt::format("the texture coordinates of \"{}\" cover no area in the scene", dressed.name));
    }
    warn_of_uvs(where, size);
    FabricReference reference{fabric, options_.tex_coord, {}};
    reference.transform = {options_.offset, options_.rotation * std::numbers::pi / 180, dressed.repeats};
    KeptParts parts = must(keep_parts(document_, material, scene, places, masks_, options_.keep));
    if (!options_.keep.base_color && is_print(scene, material) && !scene.materials[material].fabric) {
      parts.warnings.push_back(
          fmt::format("the picture \"{}\" of its base colour is a print: --keep base-colour shows it",
                      picture_name(scene, scene.materials[material])));
    }
    for (const std::string& warning : parts.warnings) report_.warnings.push_back(where + ": " + warning);
    dressed.kept = std::move(parts.kept);
    if (options_.fallback) dressed.replaced = std::move(parts.replaced);
    set_fabric_reference(document_, material, reference);
    if (options_.fallback) write_fallback(material, reference, places);
    complete_mirror(document_, material, digest_);
    report_.materials.push_back(std::move(dressed));
    return {};
  }

  void warn_of_uvs(const std::string& where, const UvSize& size) {
    constexpr double much = 0.02;  // of the area
    const auto warn = [&](double share, const std::string& what) {
      if (share > much)
        report_.warnings.push_back(fmt::format("{}: {:.0f} % of its area {}", where, 100 * share, what));
    };
    warn(size.stretched, fmt::format("shows cloth stretched more than {} times one way", max_stretch));
    warn(size.without, "has texture coordinates that cover none, and will show streaks");
  }

  void write_fallback(int material, const FabricReference& reference, const std::set<Place>& places) {
    if (!textures_) textures_ = must(add_fallback_textures(document_, bake_fallback(fabric_)));
    // TANGENT belongs to the UV set of the normal texture: tangents of another set are removed.
    const Json& normal = member(document_.json["materials"][material], "normalTexture");
    const Json& set = member(normal, names::gltf::tex_coord);
    const bool stale = (set.is_number_integer() ? set.get<int>() : 0) != options_.tex_coord;
    set_fallback(document_, material, *textures_, reference);
    if (textures_->normal < 0 || keeps(names::gltf::normal_texture, material)) return;
    for (const auto& [mesh, primitive] : places) {
      if (stale) drop_tangents(document_, mesh, primitive);
      if (must(add_tangents(document_, mesh, primitive, options_.tex_coord))) ++report_.tangents_added;
    }
  }

  bool keeps(const char* part, int material) const { return part_of(document_, material, part).is_object(); }

  GltfDocument& document_;
  const Fabric& fabric_;
  const DressOptions& options_;
  std::string digest_;
  Uses uses_;
  MaskTextures masks_;
  std::optional<FallbackTextures> textures_;
  DressReport report_;
};

/// `shape`: mm of a repeat.
Result<void> check_options(const DressOptions& options, const V2d& shape) {
  if (options.tex_coord < 0 || options.tex_coord > 1) {
    return fail(Code::option_out_of_range, "", "tex_coord", "only the UV sets 0 and 1 are read");
  }
  const V2d one(1, 1);
  const V2d repeats = options.repeats.value_or(one);
  const V2d period = options.mm_per_repeat.value_or(one);
  for (const auto& [name, value] :
       {std::pair("repeats", repeats.x), std::pair("repeats", repeats.y),
        std::pair("mm_per_repeat", period.x), std::pair("mm_per_repeat", period.y),
        std::pair("scale", options.scale), std::pair("unit", options.unit),
        std::pair("height", options.height.value_or(1))}) {
    if (!(value > 0) || !std::isfinite(value))
      return fail(Code::option_out_of_range, "", name, fmt::format("{} is not positive", value));
  }
  if (std::remainder(options.rotation, 90) != 0 && shape.x != shape.y) {
    return fail(
        Code::option_out_of_range, "", "rotation",
        fmt::format("only right angles: the repeat is {:.5g} x {:.5g} mm, not a square", shape.x, shape.y));
  }
  return {};
}

/// Puts a node that scales by `factor` above all that scenes show: skins follow, as their joints lie below.
void scale_scenes(GltfDocument& document, double factor) {
  Json& json = document.json;
  for (Json& scene : json["scenes"]) {
    if (!scene.contains("nodes")) continue;
    json["nodes"].push_back(
        Json{{"name", "true size"}, {"scale", {factor, factor, factor}}, {"children", scene["nodes"]}});
    scene["nodes"] = Json::array({json["nodes"].size() - 1});
  }
}

/// Gives the garment its true size.
void size_garment(GltfDocument& document, const DressOptions& options) {
  double factor = options.unit;
  if (options.height) {
    const Imath::Box3d bounds = bounds_of(must(read_scene(document, options.limits)));
    const double height = bounds.isEmpty() ? 0 : bounds.size().y;
    // A flat cloth that lies down has none but rounding.
    if (!(height > 1e-3 * bounds.size().length()))
      must(Result<void>(fail(Code::option_out_of_range, document.file, "height", "the garment has none")));
    factor = *options.height / height;
  }
  if (factor != 1) scale_scenes(document, factor);
}

/// The files of the USD layer, staged; empty if no layer is wanted.
std::vector<AtomicFile> stage_usd(const GltfDocument& document, const std::string& path,
                                  const SceneLimits& limits, DressReport& report) {
  if (path.empty()) return {};
  const UsdFiles files = must(usd_of(document, path, limits));
  report.warnings.insert(report.warnings.end(), files.remarks.begin(), files.remarks.end());
  return must(stage(files));
}

}  // namespace

Result<DressReport> dress(const std::string& garment_path, const std::string& fabric_path,
                          const std::string& output_path, const DressOptions& options) {
  try {
    SceneLimits limits = options.limits;
    FabricReader reader = must(FabricReader::open(fabric_path, {.memory = limits.document.memory}));
    const Fabric fabric = must(reader.read());
    limits.document.memory -= reader.memory_of(0, reader.header().levels - 1);
    must(check_options(options, options.mm_per_repeat.value_or(V2d(fabric.period_mm))));
    GltfDocument document = must(load_gltf(garment_path, limits.document));
    const std::vector<std::string> missing = drop_missing_pictures(document);
    const FabricSource source =
        must(source_of(fabric_path, output_path, options.embed.value_or(has_ending(output_path, ".glb"))));
    const std::string digest = must(digest_of_fabric(fabric_path));
    // Moved first, so that the fabric's URI and the existing ones are relative to the same folder.
    move_document(document, std::filesystem::path(output_path).parent_path().string());
    size_garment(document, options);
    DressReport report = Dresser(document, fabric, options).dress(source, digest);
    for (const std::string& file : missing)
      report.warnings.push_back(file + " is not there, and is left out");
    for (std::string& warning : outside_warnings(document, output_path))
      report.warnings.push_back(std::move(warning));
    std::vector<AtomicFile> usd = stage_usd(document, options.usd, limits, report);
    report.bytes = must(save_gltf(std::move(document), output_path));
    for (AtomicFile& file : usd) {
      must(file.commit());
      report.usd_files.push_back(file.path());
    }
    return report;
  } catch (const Failure& failure) {
    return tl::unexpected(failure.error);
  } catch (const nlohmann::json::exception& error) {
    // A wrong JSON type in an unchecked part of the document.
    return fail(Code::gltf_malformed, garment_path, "", error.what());
  }
}

}  // namespace selvedge
