#include "converter/dress/dress.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <set>

#include "converter/dress/add_tangents.h"
#include "converter/dress/backing.h"
#include "converter/dress/choose_materials.h"
#include "converter/dress/colourways.h"
#include "converter/dress/extras_mirror.h"
#include "converter/dress/fabric_source.h"
#include "converter/dress/fallback.h"
#include "converter/dress/fallback_material.h"
#include "converter/dress/garment_parts.h"
#include "converter/dress/true_size.h"
#include "converter/dress/unwrap.h"
#include "converter/dress/usd.h"
#include "format/base/guard.h"
#include "format/base/json_text.h"
#include "format/base/option_text.h"
#include "format/fabric/file.h"
#include "format/gltf/access.h"
#include "format/gltf/document.h"
#include "format/gltf/fabric_extension.h"
#include "format/gltf/geometry.h"
#include "format/gltf/material_uses.h"
#include "format/gltf/memory.h"
#include "format/gltf/mend.h"
#include "format/gltf/names.h"
#include "format/gltf/read_scene.h"
#include "format/gltf/unused_pictures.h"
#include "format/gltf/uri.h"

namespace selvedge {
namespace {

std::string name_of(const Json& material) { return string_of(member(material, "name")); }

/// A fabric that materials wear; what is made of it is made once.
struct Cloth {
  Fabric fabric;
  FabricSource source;
  std::string digest;
  int index = -1;  ///< of its entry in the document
  std::optional<Fallback> baked = {};
  std::optional<FallbackTextures> textures = {};

  const Fallback& fallback() {
    if (!baked) baked = bake_fallback(fabric);
    return *baked;
  }
};

/// A material that has been dressed, for the colourways.
struct Worn {
  FabricReference reference;
  UvSize size;
  bool stale_tangents = false;  ///< before it was dressed, TANGENT was for another UV set
};

class Dresser {
 public:
  /// `cloths`: that of the materials, and then that of each colourway, or nothing.
  Dresser(GltfDocument& document, std::vector<std::optional<Cloth>>& cloths, const DressOptions& options)
      : document_(document), cloth_(*cloths.front()), cloths_(cloths), options_(options) {}

  DressReport dress() {
    const ChosenMaterials chosen =
        must(choose_materials(document_, {options_.materials, options_.all, options_.except}));
    report_.warnings = chosen.left_alone;
    std::set<int> textures = textures_in_use(document_.json);
    Scene scene = must(read_scene(document_, options_.limits));
    memory_ = MemoryAccount(scene.memory_left);
    uses_ = uses_of(document_.json);
    if (options_.unwrap) {
      unwrap_all(chosen.materials, scene);
      scene = must(read_scene(document_, options_.limits));
    }
    for (const std::string& remark : scene.remarks) report_.warnings.push_back(remark);
    report_.bounds = bounds_of(scene);
    if (const std::string remark = judge_size(report_.bounds); !remark.empty())
      report_.warnings.push_back(remark);
    for (std::optional<Cloth>& cloth : cloths_) {
      if (cloth) cloth->index = must(add_fabric(document_, cloth->source));
    }
    std::optional<Error> left_out;
    for (const int material : chosen.materials) {
      try {
        must(dress(material, scene));
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
    for (std::size_t i = 0; i < options_.colourways.size(); ++i)
      add_colourway(options_.colourways[i], cloths_[i + 1] ? *cloths_[i + 1] : cloth_);
    if (options_.backing) add_backings(scene);
    for (const std::optional<Cloth>& cloth : cloths_) {
      if (!cloth || !cloth->textures) continue;
      textures.insert(cloth->textures->base_color);
      if (cloth->textures->normal >= 0) textures.insert(cloth->textures->normal);
    }
    if (const std::string unknown = drop_unused_pictures(document_, textures); !unknown.empty()) {
      report_.warnings.push_back(
          fmt::format("pictures that nothing uses any more stay in the file: {} may refer to them", unknown));
    }
    report_.embedded = cloth_.source.uri.empty();
    return std::move(report_);
  }

 private:
  void unwrap_all(const std::vector<int>& materials, const Scene& scene) {
    std::set<Place> done;
    for (const int material : materials) {
      std::set<Place> places;
      std::set_difference(uses_[material].begin(), uses_[material].end(), done.begin(), done.end(),
                          std::inserter(places, places.end()));
      if (places.empty()) continue;
      const Unwrapped made = must(unwrap(document_, places, options_.tex_coord, scene, memory_));
      report_.unwrapped.emplace(material, made);
      if (made.replaced) {
        report_.warnings.push_back(fmt::format(
            "material #{}: pictures on its former texture coordinates show in other places now", material));
      }
      done.merge(places);
    }
  }

  Result<void> dress(int material, const Scene& scene) {
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
    Worn worn{reference_to(cloth_, size), size, has_stale_tangents(material)};
    dressed.repeats = worn.reference.transform.scale;
    if (!(dressed.repeats.x > 0) || !(dressed.repeats.y > 0)) {
      return fail(Code::garment_no_uvs, document_.file, fmt::format("/materials/{}", material),
                  fmt::format("the texture coordinates of \"{}\" cover no area in the scene", dressed.name));
    }
    warn_of_uvs(where, size);
    KeptParts parts = must(keep_parts(document_, material, scene, places, masks_, options_.keep));
    if (!options_.keep.base_color && is_print(scene, material) && !scene.materials[material].fabric) {
      parts.warnings.push_back(
          fmt::format("the picture \"{}\" of its base colour is a print: --keep base-colour shows it",
                      picture_name(scene, scene.materials[material])));
    }
    for (const std::string& warning : parts.warnings) report_.warnings.push_back(where + ": " + warning);
    dressed.kept = std::move(parts.kept);
    if (options_.fallback) dressed.replaced = std::move(parts.replaced);
    wear(material, cloth_, worn, places);
    worn_.emplace(material, worn);
    report_.materials.push_back(std::move(dressed));
    return {};
  }

  FabricReference reference_to(const Cloth& cloth, const UvSize& size) const {
    const V2d period = options_.mm_per_repeat.value_or(V2d(cloth.fabric.period_mm)) * options_.scale;
    // A cloth that lies on its side has its courses along v.
    const bool on_side = std::lround(options_.rotation / 90) % 2 != 0;
    V2d repeats = options_.repeats.value_or(V2d(0, 0));
    for (int c = 0; c < 2 && !options_.repeats; ++c)
      repeats[c] = size.metres[c] * 1000.0 / period[on_side ? 1 - c : c];
    return {cloth.index,
            options_.tex_coord,
            {options_.offset, options_.rotation * std::numbers::pi / 180, repeats}};
  }

  /// Writes the reference, its mirror and the fallback.
  void wear(int material, Cloth& cloth, const Worn& worn, const std::set<Place>& places) {
    set_fabric_reference(document_, material, worn.reference);
    if (options_.fallback) write_fallback(material, cloth, worn, places);
    complete_mirror(document_, material, cloth.digest);
  }

  void warn_of_uvs(const std::string& where, const UvSize& size) {
    constexpr double much = 0.02;  // of the area
    const auto warn = [&](double share, const std::string& what) {
      if (share > much)
        report_.warnings.push_back(fmt::format("{}: {:.0f} % of its area {}", where, 100 * share, what));
    };
    warn(size.stretched, fmt::format("shows cloth stretched more than {} times one way", max_stretch));
    warn(
        size.shared,
        "shares its texture coordinates with other parts, which matters for pictures that are painted on it");
    warn(size.without, "has texture coordinates that cover none, and will show streaks");
  }

  /// TANGENT belongs to the UV set of the normal texture.
  bool has_stale_tangents(int material) const {
    const Json& normal = member(document_.json["materials"][material], "normalTexture");
    return std::max(0, index_of(member(normal, names::gltf::tex_coord))) != options_.tex_coord;
  }

  void write_fallback(int material, Cloth& cloth, const Worn& worn, const std::set<Place>& places) {
    if (!cloth.textures) cloth.textures = must(add_fallback_textures(document_, cloth.fallback()));
    set_fallback(document_, material, *cloth.textures, worn.reference);
    if (cloth.textures->normal < 0 || keeps(names::gltf::normal_texture, material)) return;
    for (const Place& place : places) {
      // The tangents of a place are made once: colourways share them.
      if (!with_tangents_.insert(place).second) continue;
      if (worn.stale_tangents) drop_tangents(document_, place.first, place.second);
      if (must(add_tangents(document_, place.first, place.second, options_.tex_coord)))
        ++report_.tangents_added;
    }
  }

  void add_colourway(const Colourway& colourway, Cloth& cloth) {
    const int variant = must(add_variant(document_, colourway.name));
    bool shown = false;
    for (auto& [material, worn] : worn_) {
      const std::string text = document_.json["materials"][material].dump();
      if (!memory_.take(text.size(), 1) ||
          !memory_.take(demands_of(text, options_.limits.document.nesting).values, memory_price::json_value))
        throw Failure{beyond_memory(document_.file, "/materials", "its variants", memory_.limit())};
      const int copy = copy_for_variant(document_, material, uses_[material], variant);
      if (copy < 0) continue;
      shown = true;
      VariantMaterial made{colourway.name, copy, material};
      if (colourway.color) {
        const V3f tint = tint_towards(*colourway.color, cloth.fallback().albedo);
        made.tint = tint;
        document_.json["materials"][copy]["extensions"][names::gltf::fabric_extension]
                      [names::gltf::tint_factor] = {tint.x, tint.y, tint.z};
      }
      Worn in_variant = worn;
      in_variant.reference = reference_to(cloth, worn.size);
      made.repeats = in_variant.reference.transform.scale;
      wear(copy, cloth, in_variant, uses_[material]);
      report_.variants.push_back(std::move(made));
    }
    if (!shown) {
      report_.warnings.push_back(fmt::format(
          "variant \"{}\" changes nothing: only other variants wear the dressed materials", colourway.name));
    }
    if (colourway.color) warn_of_colour(colourway, cloth.fallback().albedo);
  }

  void warn_of_colour(const Colourway& colourway, const V3f& albedo) {
    const V3f tint = tint_towards(*colourway.color, albedo);
    const float largest = std::max({tint.x, tint.y, tint.z});
    if (largest <= 1) return;
    report_.warnings.push_back(
        fmt::format("variant \"{}\" is brighter than the fabric, which reflects {:.2f} {:.2f} {:.2f}: {}",
                    colourway.name, albedo.x, albedo.y, albedo.z,
                    largest < static_cast<float>(max_tint) ? "other viewers show no more than that"
                                                           : "it is not reached"));
  }

  void add_backings(const Scene& scene) {
    constexpr double behind = 0.25;  // of the shorter side of a repeat
    for (const auto& [material, worn] : worn_) {
      const V2d mm = worn.size.metres * 1000.0 / worn.reference.transform.scale;
      const Backing backing{*options_.backing, behind * std::min(mm.x, mm.y) / 1000};
      report_.backed += must(add_backing(document_, material, uses_[material], scene, backing, memory_));
    }
  }

  bool keeps(const char* part, int material) const { return part_of(document_, material, part).is_object(); }

  GltfDocument& document_;
  Cloth& cloth_;
  std::vector<std::optional<Cloth>>& cloths_;
  const DressOptions& options_;
  MemoryAccount memory_{0};
  Uses uses_;
  std::map<int, Worn> worn_;  ///< by material
  std::set<Place> with_tangents_;
  MaskTextures masks_;
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

/// Reads a fabric, and takes its memory from the limit.
Cloth read_cloth(const std::string& path, const std::string& output_path, const DressOptions& options,
                 SceneLimits& limits) {
  FabricReader reader = must(FabricReader::open(path, {.memory = limits.document.memory}));
  Cloth cloth{must(reader.read()), {}, {}};
  limits.document.memory -= reader.memory_of(0, reader.header().levels - 1);
  must(check_options(options, options.mm_per_repeat.value_or(V2d(cloth.fabric.period_mm))));
  cloth.source = must(source_of(path, output_path, options.embed.value_or(has_ending(output_path, ".glb"))));
  cloth.digest = must(digest_of_fabric(path));
  return cloth;
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
    std::vector<std::optional<Cloth>> cloths{read_cloth(fabric_path, output_path, options, limits)};
    for (const Colourway& colourway : options.colourways) {
      cloths.emplace_back();
      if (!colourway.fabric.empty())
        cloths.back() = read_cloth(colourway.fabric, output_path, options, limits);
    }
    GltfDocument document = must(load_gltf(garment_path, limits.document));
    const std::vector<std::string> mended = must(mend(document));
    const std::vector<std::string> missing = must(drop_missing_pictures(document));
    // Moved first, so that the fabric's URI and the existing ones are relative to the same folder.
    move_document(document, std::filesystem::path(output_path).parent_path().string());
    must(size_garment(document, options.unit, options.height, options.limits));
    DressReport report = Dresser(document, cloths, options).dress();
    report.warnings.insert(report.warnings.end(), mended.begin(), mended.end());
    for (const std::string& fault : missing) report.warnings.push_back(fault + ", and is left out");
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
