#include "converter/dress/dress.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "converter/dress/choose_materials.h"
#include "converter/dress/fabric_source.h"
#include "converter/dress/fallback.h"
#include "converter/dress/true_size.h"
#include "converter/dress/usd.h"
#include "format/base/option_text.h"
#include "format/fabric/file.h"
#include "format/gltf/access.h"
#include "format/gltf/document.h"
#include "format/gltf/edit.h"
#include "format/gltf/fabric_extension.h"
#include "format/gltf/materials.h"
#include "format/gltf/memory.h"
#include "format/gltf/names.h"
#include "format/gltf/read_scene.h"
#include "format/gltf/unused_parts.h"

namespace selvedge {
namespace {

/// Bytes of a corner that is dressed, and of one that is laid flat.
constexpr std::uint64_t corner_price = 128;
constexpr std::uint64_t unwrapped_corner_price = 896;
/// Fraction of the area whose texture coordinates may be useless.
constexpr double max_unusable = 0.1;

/// A fabric that materials wear; what is made of it is made once.
struct Cloth {
  Fabric fabric;
  FabricSource source;
  int index = -1;  ///< of its entry in the document
  std::optional<FallbackFactors> factors = {};
  std::optional<Fallback> baked = {};
  int texture = -1;

  const Fallback& fallback() {
    if (!baked) baked = bake_fallback(fabric);
    return *baked;
  }
  V3f albedo() {
    if (!factors) factors = fallback_of(fabric);
    return factors->albedo;
  }
};

/// `shape`: mm of a repeat. Throws Failure.
void check_options(const DressOptions& options, const V2d& shape) {
  const auto refuse = [](const char* option, std::string why) {
    throw Failure{{Code::option_out_of_range, "", option, std::move(why)}};
  };
  if (options.tex_coord < 0 || options.tex_coord > 1)
    refuse("tex_coord", "only the UV sets 0 and 1 are read");
  const V2d one(1, 1);
  const V2d repeats = options.repeats.value_or(one);
  for (const auto& [name, value] :
       {std::pair("repeats", std::abs(repeats.x)), std::pair("repeats", std::abs(repeats.y)),
        std::pair("scale", options.scale), std::pair("unit", options.metres_per_unit),
        std::pair("height", options.garment_height.value_or(1))})
    if (!(value > 0) || !std::isfinite(value)) refuse(name, fmt::format("{} is not positive", value));
  if (std::remainder(options.rotation_degrees, 90) != 0 && shape.x != shape.y)
    refuse("rotation", fmt::format("only right angles: the repeat is {:.5g} x {:.5g} mm, not a square",
                                   shape.x, shape.y));
}

/// Reads a fabric, takes its memory from the limits, and refuses options that do not go with it. Throws
/// Failure.
Cloth read_cloth(const std::string& path, const std::string& output_path, const DressOptions& options,
                 SceneLimits& limits) {
  FabricReader reader = value_or_throw(FabricReader::open(path, {.memory = limits.document.memory}));
  Cloth cloth{arranged(value_or_throw(reader.read())), {}};
  limits.document.memory -= reader.peak_memory_bytes();
  check_options(options, V2d(cloth.fabric.period_mm));
  cloth.source =
      value_or_throw(source_of(path, output_path, options.embed.value_or(has_ending(output_path, ".glb"))));
  return cloth;
}

std::string name_of(const Json& material) { return string_of(member(material, "name")); }

/// How a dressed material uses its cloth, for the colourways.
struct DressedUse {
  FabricReference reference;
  UvSize size;
};

class Dresser {
 public:
  /// `cloths`: for the materials, and then for each colourway its own or nothing.
  Dresser(GltfDocument& document, std::vector<std::optional<Cloth>>& cloths, const DressOptions& options,
          const SceneLimits& limits)
      : document_(document), cloth_(*cloths.front()), cloths_(cloths), options_(options), limits_(limits) {}

  DressReport dress() {
    if (options_.all_cloth) add_missing_material(document_);
    uses_ = find_material_uses(document_.json);
    value_or_throw(scale_garment(document_, options_.metres_per_unit));
    Scene scene = value_or_throw(read_scene(document_, limits_));
    ChosenMaterials chosen = value_or_throw(choose_materials(
        document_, scene, {options_.materials, options_.all_cloth, options_.excluded_materials}));
    report_.warnings = chosen.skipped_materials;
    reserve_memory(scene, chosen.materials, corner_price);
    std::map<std::string, double> strays = measure(scene, chosen.materials);
    if (options_.garment_height) {
      const double present = report_.bounds.isEmpty() ? 0 : report_.bounds.size().y;
      // A flat cloth that lies down has none but rounding.
      if (!(present > 1e-3 * report_.bounds.size().length()))
        throw Failure{{Code::option_out_of_range, document_.file, "height", "the garment has no height"}};
      scene = Scene();  // before the next takes its place in memory
      value_or_throw(scale_garment(document_, *options_.garment_height / present));
      scene = value_or_throw(read_scene(document_, limits_));
      strays = measure(scene, chosen.materials);
    }
    std::vector<int> flat = to_unwrap(scene, chosen.materials);
    const UsedParts used = used_parts(document_);
    if (!flat.empty() || options_.backing) in_scene_ = primitives_in(scene);
    if (!flat.empty()) {
      reserve_memory(scene, flat, unwrapped_corner_price);
      scene = Scene();
      // Those without anything to lay flat are not dressed.
      std::set<PrimitiveIndex> done;
      for (const int material : flat)
        if (!attempt(material, [&] { unwrap_material(material, done); }))
          std::erase(chosen.materials, material);
      scene = value_or_throw(read_scene(document_, limits_));
    }
    for (const std::string& remark : scene.remarks) report_.warnings.push_back(remark);
    for (const auto& [part, metres] : strays)
      report_.warnings.push_back(
          fmt::format("{} lies {:.3g} m from the rest, and does not count for the size", part, metres));
    const V3d size = report_.bounds.isEmpty() ? V3d(0) : report_.bounds.size();
    if (const std::string advice = size_advice(size);
        !advice.empty() && options_.metres_per_unit == 1 && !options_.garment_height)
      report_.warnings.push_back(advice);
    for (std::optional<Cloth>& cloth : cloths_)
      if (cloth) cloth->index = value_or_throw(add_fabric(document_, cloth->source));
    if (options_.lies_once) {
      std::map<int, V2i> materials_and_sets;
      for (const int material : chosen.materials)
        for (const int primitive : primitives_of(scene, material))
          materials_and_sets.try_emplace(primitive, material, set_of(material));
      parts_ = uv_parts(scene, materials_and_sets);
    }
    std::map<int, double> backed;
    if (!options_.single_sided) backed = double_layer_fractions(scene);
    for (const int material : chosen.materials)
      attempt(material, [&] { dress(material, scene, backed[material]); });
    if (report_.materials.empty())
      throw Failure{left_out_.value_or(
          Error{Code::garment_empty, document_.file, "/materials", "the materials are on no triangles"})};
    for (std::size_t i = 0; i < options_.colourways.size(); ++i)
      add_colourway(options_.colourways[i], cloths_[i + 1] ? *cloths_[i + 1] : cloth_);
    if (options_.backing) add_backings();
    drop_unused_parts(document_, used);
    report_.embedded = cloth_.source.uri.empty();
    return std::move(report_);
  }

 private:
  /// Finds the bounds of the materials, and returns the parts of the scene that lie far from everything.
  std::map<std::string, double> measure(const Scene& scene, const std::vector<int>& materials) {
    const Imath::Box3d all = bounds_of(scene);
    if (!all.isEmpty() && !(is_in_coordinate_range(all.min) && is_in_coordinate_range(all.max)))
      throw Failure{Error{Code::mesh_not_finite, document_.file, "/nodes", "places lie beyond 10^9 m"}};
    std::set<int> dressed;
    for (const int material : materials) dressed.merge(primitives_of(scene, material));
    std::set<int> every;
    for (int i = 0; i < static_cast<int>(scene.primitives.size()); ++i) every.insert(i);
    GarmentBounds bounds = robust_bounds(scene, dressed);
    report_.bounds = bounds.box;
    if (dressed != every) bounds.stray_distances.merge(robust_bounds(scene, every).stray_distances);
    return std::move(bounds.stray_distances);
  }

  /// Takes from the limits what dressing makes of the primitives at most: backings and charts.
  /// Primitives may share their accessors, but get copies of their own.
  void reserve_memory(Scene& scene, const std::vector<int>& materials, std::uint64_t price) {
    constexpr std::uint64_t value_price = 32;  // of a corner in each accessor
    MemoryBudget budget(scene.memory_left);
    std::set<PrimitiveIndex> places;
    for (const int material : materials) places.insert(uses_[material].begin(), uses_[material].end());
    for (const PrimitiveIndex& place : places) {
      const Json& primitive = primitive_at(document_, place);
      std::set<int> accessors;
      for (const Json& accessor : member(primitive, "attributes")) accessors.insert(index_of(accessor));
      for (const Json& target : array_member(primitive, "targets"))
        for (const Json& accessor : target) accessors.insert(index_of(accessor));
      const Json& indices = member(primitive, "indices");
      const Json& corners = indices.is_null() ? member(member(primitive, "attributes"), "POSITION") : indices;
      // Faults are found later.
      const auto shape =
          catch_failure([&] { return GltfReader(document_).accessor_shape(index_of(corners), ""); });
      const std::size_t count = shape ? shape->count : 0;
      if (!budget.try_spend(count, price + value_price * accessors.size()))
        throw Failure{memory_limit_error(document_.file, member_pointer(place), "its dressed vertices",
                                         limits_.document.memory)};
    }
    limits_.document.memory -= scene.memory_left - budget.unspent_bytes();
    scene.memory_left = budget.unspent_bytes();
  }

  /// Whether the work on a material was done: `all` skips those that cannot be dressed, named ones must be.
  template <class F>
  bool attempt(int material, const F& work) {
    try {
      work();
      return true;
    } catch (const Failure& failure) {
      const Code code = failure.error.code;
      if (!options_.all_cloth || (code != Code::garment_no_uvs && code != Code::garment_empty)) throw;
      report_.warnings.push_back(
          fmt::format("material #{} was left alone: {}", material, failure.error.message));
      if (!left_out_) left_out_ = failure.error;
      return false;
    }
  }

  /// The places of a material that no earlier one has.
  std::set<PrimitiveIndex> fresh_places(int material, const std::set<PrimitiveIndex>& done) {
    std::set<PrimitiveIndex> places;
    std::set_difference(uses_[material].begin(), uses_[material].end(), done.begin(), done.end(),
                        std::inserter(places, places.end()));
    return places;
  }

  /// Indices of the primitives of a material.
  std::set<int> primitives_of(const Scene& scene, int material) {
    std::set<int> primitives;
    for (int i = 0; i < static_cast<int>(scene.primitives.size()); ++i) {
      const ScenePrimitive& primitive = scene.primitives[i];
      if (uses_[material].contains(PrimitiveIndex(primitive.mesh, primitive.primitive_index)))
        primitives.insert(i);
    }
    return primitives;
  }

  /// The materials that get texture coordinates, each with a remark where that was not asked for.
  std::vector<int> to_unwrap(const Scene& scene, const std::vector<int>& materials) {
    if (options_.unwrap == Unwrapping::always) return materials;
    std::vector<int> flat;
    if (options_.unwrap == Unwrapping::never || options_.repeats) return flat;
    for (const int material : materials) {
      const UvSize size = measure_uv(scene, primitives_of(scene, material), options_.tex_coord);
      if (!(size.unusable_fraction > max_unusable)) continue;
      report_.warnings.push_back(fmt::format(
          "material #{} has new texture coordinates: its own are {} on {:.0f} % of its area; --unwrap never "
          "keeps them",
          material,
          size.unusable_fraction - size.fraction_without_uvs > size.fraction_without_uvs
              ? "stretched beyond use"
              : "missing",
          100 * size.unusable_fraction));
      flat.push_back(material);
      // A print keeps its own.
      if (!has_pictures(material)) continue;
      fill_gaps(material, 0);
      if (check_uvs(document_, uses_[material], 0)) sets_[material] = 1;
    }
    return flat;
  }

  bool has_pictures(int material) const {
    const Json& json = document_.json["materials"][material];
    return json.contains("normalTexture") || !base_texture_of(json).is_null();
  }

  /// Gives primitives without texture coordinates zeros if others of the material have some: a few triangles
  /// without do not cost the rest theirs.
  void fill_gaps(int material, int set) {
    const std::string semantic = fmt::format("TEXCOORD_{}", set);
    const auto attributes_of = [&](const PrimitiveIndex& place) -> const Json& {
      return member(primitive_at(document_, place), "attributes");
    };
    const auto has = [&](const PrimitiveIndex& place) { return attributes_of(place).contains(semantic); };
    const std::set<PrimitiveIndex>& places = uses_[material];
    if (std::ranges::none_of(places, has)) return;
    for (const PrimitiveIndex& place : places) {
      const int positions = index_of(member(attributes_of(place), "POSITION"));
      if (has(place) || positions < 0) continue;
      const std::size_t count = GltfReader(document_).accessor_shape(positions, "").count;
      primitive_at(document_, place)["attributes"][semantic] =
          append_float_accessor(document_, std::vector<float>(2 * count), 2, false);
    }
  }

  /// The set of texture coordinates that a material's fabric is on.
  int set_of(int material) const {
    const auto own = sets_.find(material);
    return own == sets_.end() ? options_.tex_coord : own->second;
  }

  void unwrap_material(int material, std::set<PrimitiveIndex>& done) {
    std::set<PrimitiveIndex> places = fresh_places(material, done);
    if (places.empty()) return;
    const UnwrapReport made =
        map_failure([&] { return value_or_throw(unwrap(document_, places, set_of(material), in_scene_)); },
                    [&](Error error) {
                      if (error.file.empty()) error.file = document_.file;
                      if (error.place.empty()) error.place = fmt::format("/materials/{}", material);
                      return error;
                    });
    report_.unwrap_reports.emplace(material, made);
    if (made.had_uvs && has_pictures(material))
      report_.warnings.push_back(fmt::format(
          "material #{}: pictures on its former texture coordinates show in other places now", material));
    done.merge(places);
  }

  /// Where the triangles of the first such material are that the scene does not show, for a message.
  std::string elsewhere(int material) {
    constexpr std::size_t max_scenes = 8;
    const Json& scenes = array_member(document_.json, "scenes");
    if (std::exchange(looked_elsewhere_, true)) return "";
    for (std::size_t i = 0; i < std::min(scenes.size(), max_scenes); ++i) {
      SceneChoice choice;
      choice.scene = std::to_string(i);
      const auto other = read_scene(document_, limits_, choice);
      if (!other || primitives_of(*other, material).empty()) continue;
      return fmt::format(": it is in scene {} \"{}\", which \"scene\" in the JSON would make the default one",
                         i, name_of(scenes[i]));
    }
    return ": it is hidden, or in no scene";
  }

  /// `backed`: the fraction of double_layer_fractions.
  void dress(int material, const Scene& scene, double backed) {
    const std::set<PrimitiveIndex>& places = uses_[material];
    DressedMaterial dressed;
    dressed.index = material;
    dressed.name = name_of(document_.json["materials"][material]);
    const std::string where = fmt::format("material #{} \"{}\"", material, dressed.name);
    if (places.empty()) {
      report_.warnings.push_back(where + " is on no triangles and was left alone");
      return;
    }
    for (int set = 0; set <= set_of(material); ++set) fill_gaps(material, set);
    map_failure([&] { value_or_throw(check_uvs(document_, places, set_of(material))); },
                [](Error error) {
                  if (error.code == Code::garment_no_uvs) error.message += "; --unwrap always makes some";
                  return error;
                });

    const UvSize size = measure_uv(scene, primitives_of(scene, material), set_of(material));
    dressed.primitive_count = size.primitives;
    dressed.uv_size = size;
    DressedUse use{reference_to(cloth_, size, material), size};
    dressed.repeats = use.reference.transform.scale;
    if (!(std::abs(dressed.repeats.x) > 0) || !(std::abs(dressed.repeats.y) > 0)) {
      const bool is_absent = primitives_of(scene, material).empty();
      throw Failure{
          {is_absent ? Code::garment_empty : Code::garment_no_uvs, document_.file,
           fmt::format("/materials/{}", material),
           is_absent
               ? fmt::format("\"{}\" is on no triangle in the scene{}", dressed.name, elsewhere(material))
               : fmt::format("the texture coordinates of \"{}\" cover no area in the scene", dressed.name)}};
    }
    warn_of_uvs(where, size);
    warn_of_repeats(where, material, use);
    KeptMaterialMembers parts = value_or_throw(
        keep_material_members(document_, material, scene, places, options_.color_options, cloth_.albedo()));
    for (const std::string& warning : parts.warnings) report_.warnings.push_back(where + ": " + warning);
    dressed.kept_members = std::move(parts.kept);
    Json& core = document_.json["materials"][material];
    dressed.replaced_members =
        options_.has_fallback ? std::move(parts.replaced) : drop_lobes(document_, core, true);
    if (!options_.single_sided) choose_sides(core, where, backed);
    wear(material, cloth_, use);
    dressed_.emplace(material, use);
    report_.materials.push_back(std::move(dressed));
  }

  /// Cloth shows its back, but for sheets back to back, which would show through each other.
  void choose_sides(Json& core, const std::string& where, double backed) {
    const bool two_sided = member(core, "doubleSided") == true;
    const bool single = backed > (two_sided ? 0.9 : 0.1);
    if (two_sided == single) core["doubleSided"] = !single;
    if (single) report_.warnings.push_back(where + " is single-sided: other triangles lie on its back");
    if (!single && !two_sided)
      report_.warnings.push_back(where + " shows its back, too; --single-sided hides it");
  }

  /// Where the repeat begins that a material shows, along both axes.
  double first_place(int material) const { return material == parts_[0].material ? 0 : -0.5; }

  void warn_of_repeats(const std::string& where, int material, const DressedUse& use) {
    constexpr double tolerance = 1e-3;  // of a repeat
    int count = 0;
    int beyond = 0;
    for (const UvPart& part : parts_) {
      if (part.material != material) continue;
      const double begin = first_place(material);
      const Imath::Box2d repeat(V2d(begin - tolerance), V2d(begin + 1 + tolerance));
      const auto& [low, high] = part.box;
      for (const V2d& uv : {low, V2d(low.x, high.y), V2d(high.x, low.y), high})
        if (!repeat.intersects(use.reference.transform.apply(uv))) {
          ++beyond;
          break;
        }
      ++count;
    }
    const V2d metres = use.size.metres_per_uv / use.reference.transform.scale;
    if (beyond > 0)
      report_.warnings.push_back(fmt::format(
          "{}: {} of its {} parts reach beyond the repeat of {:.3g} x {:.3g} m, which begins again there",
          where, beyond, count, std::abs(metres.x), std::abs(metres.y)));
  }

  FabricReference reference_to(const Cloth& cloth, const UvSize& size, int material) const {
    const V2d period = V2d(cloth.fabric.period_mm) * options_.scale;
    // A cloth that lies on its side has its courses along v.
    const bool on_side = std::lround(options_.rotation_degrees / 90) % 2 != 0;
    V2d repeats = options_.repeats.value_or(V2d(0, 0));
    for (int c = 0; c < 2 && !options_.repeats; ++c)
      repeats[c] = size.metres_per_uv[c] * 1000.0 / period[on_side ? 1 - c : c];
    UvTransform transform{options_.offset, options_.rotation_degrees * std::numbers::pi / 180, repeats};
    const auto own = std::ranges::find(parts_, material, &UvPart::material);
    if (own != parts_.end())
      transform.offset += V2d(first_place(material) + 0.5) - transform.apply_linear(own->middle);
    return {cloth.index, set_of(material), transform};
  }

  /// Writes the reference and the fallback.
  void wear(int material, Cloth& cloth, const DressedUse& use) {
    if (const std::optional<TransformFault> fault = fabric_transform_fault(use.reference.transform))
      throw Failure{{Code::gltf_extension, document_.file, fmt::format("/materials/{}", material),
                     fmt::format("invalid texture transform: {}: {}", fault->member, fault->reason)}};
    set_fabric_reference(document_, material, use.reference);
    if (!options_.has_fallback) return;
    const bool printed =
        keeps(names::gltf::tint_texture, material) || keeps(names::gltf::mask_texture, material);
    if (cloth.texture < 0 && !printed)
      cloth.texture = value_or_throw(add_fallback_texture(document_, cloth.fallback()));
    set_fallback(document_, material, cloth.fallback(), cloth.texture, use.reference);
  }

  void warn_of_uvs(const std::string& where, const UvSize& size) {
    constexpr double much = 0.02;  // of the area
    const auto warn = [&](double fraction, const std::string& what) {
      if (fraction > much)
        report_.warnings.push_back(fmt::format("{}: {:.0f} % of its area {}", where, 100 * fraction, what));
    };
    warn(size.stretched_fraction,
         fmt::format("shows cloth stretched more than {} times one way", max_stretch));
    warn(size.fraction_without_uvs, "has degenerate texture coordinates and will show streaks");
  }

  void add_colourway(const Colourway& colourway, Cloth& cloth) {
    const int variant = value_or_throw(add_material_variant(document_, colourway.name));
    bool shown = false;
    for (auto& [material, use] : dressed_) {
      const int copy = copy_for_variant(document_, material, uses_[material], variant);
      if (copy < 0) continue;
      shown = true;
      VariantMaterial made{colourway.name, copy, material};
      if (colourway.color) {
        const V3f tint = tint_for_color(*colourway.color, cloth.albedo());
        made.tint = tint;
        document_.json["materials"][copy]["extensions"][names::gltf::fabric_extension]
                      [names::gltf::tint_factor] = {tint.x, tint.y, tint.z};
      }
      DressedUse in_variant = use;
      in_variant.reference = reference_to(cloth, use.size, material);
      made.repeats = in_variant.reference.transform.scale;
      wear(copy, cloth, in_variant);
      report_.variants.push_back(std::move(made));
    }
    if (!shown)
      report_.warnings.push_back(fmt::format(
          "variant \"{}\" changes nothing: only other variants wear the dressed materials", colourway.name));
    if (!colourway.color) return;
    const V3f color = *colourway.color;
    // Darker than cloth can be is no fault of the fabric.
    V3f tint;
    for (int c = 0; c < 3; ++c) tint[c] = color[c] / std::max(cloth.albedo()[c], 1e-6F);
    if (auto issue = unreached_variant(document_.file, fmt::format("variant \"{}\"", colourway.name),
                                       cloth.albedo(), tint))
      report_.issues.push_back(std::move(*issue));
  }

  void add_backings() {
    constexpr double behind = 0.25;  // of the shorter side of a repeat
    std::set<PrimitiveIndex> done;   // a place may wear several materials, by default and in variants
    for (const auto& [material, use] : dressed_) {
      if (keeps(names::gltf::mask_texture, material)) {
        report_.warnings.push_back(fmt::format(
            "material #{} has no backing: it would show where the mask cuts the cloth away", material));
        continue;
      }
      std::set<PrimitiveIndex> places = fresh_places(material, done);
      const V2d mm = use.size.metres_per_uv * 1000.0 / use.reference.transform.scale;
      const Backing backing{*options_.backing, behind * std::min(std::abs(mm.x), std::abs(mm.y)) / 1000};
      report_.backed_primitive_count += add_backing(document_, material, places, in_scene_, backing);
      done.merge(places);
    }
  }

  bool keeps(const char* part, int material) const {
    return fabric_extension_member(document_, material, part).is_object();
  }

  GltfDocument& document_;
  Cloth& cloth_;
  std::vector<std::optional<Cloth>>& cloths_;
  const DressOptions& options_;
  SceneLimits limits_;  ///< what the fabrics and the places of the materials leave of the options'
  MaterialUses uses_;
  PrimitivesInScene in_scene_;  ///< where charts or backings are wanted
  std::map<int, int> sets_;     ///< of materials that were laid flat beside the pictures' set
  std::vector<UvPart> parts_;   ///< where the cloth lies once
  bool looked_elsewhere_ = false;
  std::optional<Error> left_out_;      ///< why the first material was left alone
  std::map<int, DressedUse> dressed_;  ///< by material
  DressReport report_;
};

}  // namespace

Result<DressReport> dress(const std::string& garment_path, const std::string& fabric_path,
                          const std::string& output_path, const DressOptions& options) {
  return result_of_edit(garment_path, [&] {
    SceneLimits limits = options.limits;
    std::vector<std::optional<Cloth>> cloths{read_cloth(fabric_path, output_path, options, limits)};
    for (const Colourway& colourway : options.colourways) {
      cloths.emplace_back();
      if (!colourway.fabric.empty())
        cloths.back() = read_cloth(colourway.fabric, output_path, options, limits);
    }
    GltfDocument document = load_garment(garment_path, output_path, limits.document);
    DressReport report = Dresser(document, cloths, options, limits).dress();
    for (std::string& warning : outside_warnings(document, output_path))
      report.warnings.push_back(std::move(warning));
    std::vector<AtomicFile> usd;
    if (!options.usd_path.empty()) {
      const UsdFiles files = value_or_throw(usd_of(document, options.usd_path, limits));
      report.warnings.insert(report.warnings.end(), files.remarks.begin(), files.remarks.end());
      usd = stage_files(files);
    }
    if (!options.run_key.empty()) document.json["asset"]["extras"][run_key_member] = options.run_key;
    StagedGltf staged = value_or_throw(stage_gltf(std::move(document), output_path));
    report.bytes = staged.byte_count;
    report.warnings.insert(report.warnings.end(), staged.remarks.begin(), staged.remarks.end());
    for (AtomicFile& file : usd) {
      report.usd_files.push_back(file.path());
      staged.files.push_back(std::move(file));
    }
    value_or_throw(commit_all(std::move(staged.files)));
    return report;
  });
}

}  // namespace selvedge
