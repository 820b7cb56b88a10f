#include "viewer/scene/change_fabrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace selvedge {
namespace {

/// The transform that follows `transform` by a quarter turn of the cloth: with the period P, D(1/P) R D(P).
/// It keeps the form "scale, then rotate", as R D(a, b) = D(b, a) R.
void turn_quarter(const V2d& period, UvTransform& transform) {
  const V2d stretch(period.x / period.y, period.y / period.x);
  const bool on_side = std::lround(transform.rotation / (std::numbers::pi / 2)) % 2 != 0;
  transform.scale *= on_side ? V2d(stretch.y, stretch.x) : stretch;
  const V2d offset = transform.offset * stretch;
  UvTransform quarter;
  quarter.rotation = std::numbers::pi / 2;
  transform.offset = quarter.apply_linear(offset);
  transform.rotation = std::remainder(transform.rotation + quarter.rotation, 2 * std::numbers::pi);
}

/// The part of a primitive's material that pictures show, but for the tint of its fabric.
SceneMaterial seen_material(const Scene& scene, const ScenePrimitive& primitive) {
  if (primitive.material < 0) return {};
  SceneMaterial seen = scene.materials[primitive.material];
  seen.name.clear();
  if (!seen.fabric) return seen;
  SceneMaterial cloth;
  cloth.occlusion_texture = seen.occlusion_texture;
  cloth.occlusion_strength = seen.occlusion_strength;
  cloth.emissive = seen.emissive;
  cloth.emissive_texture = seen.emissive_texture;
  cloth.alpha_mode = seen.alpha_mode;
  cloth.fabric = seen.fabric;
  cloth.garment_textures = seen.garment_textures;
  cloth.garment_textures.tint = V3f(1, 1, 1);
  return cloth;
}

}  // namespace

std::vector<int> fabrics_of(const Scene& scene) {
  std::vector<int> result;
  for (const SceneMaterial& material : scene.materials)
    result.push_back(material.fabric ? material.fabric->fabric : -1);
  return result;
}

bool has_no_fabric(const Scene& scene) {
  return std::ranges::none_of(scene.materials, [](const SceneMaterial& m) { return m.fabric.has_value(); });
}

Scene change_fabrics(const Scene& scene, std::span<const Fabric> fabrics, std::span<const int> choice) {
  Scene result = scene;
  for (std::size_t i = 0; i < result.materials.size(); ++i) {
    std::optional<FabricReference>& reference = result.materials[i].fabric;
    if (!reference || reference->fabric == choice[i]) continue;
    if (choice[i] < 0) {
      reference.reset();
      continue;
    }
    const V2d old_period(fabrics[reference->fabric].period_mm);
    const V2d new_period(fabrics[choice[i]].period_mm);
    V2d ratio = old_period / new_period;
    if (reference->transform.rotation != 0) ratio = V2d(std::sqrt(ratio.x * ratio.y));
    reference->transform.offset *= ratio;
    reference->transform.scale *= ratio;
    reference->fabric = choice[i];
  }
  return result;
}

void fit_fabrics(std::span<const FabricFit> fits, std::span<const Fabric> fabrics, Scene& scene) {
  for (std::size_t i = 0; i < scene.materials.size(); ++i) {
    SceneMaterial& material = scene.materials[i];
    if (!material.fabric) continue;
    UvTransform& transform = material.fabric->transform;
    transform.offset /= fits[i].stitch_scale;
    transform.scale /= fits[i].stitch_scale;
    for (int turn = 0; turn < fits[i].quarter_turns; ++turn)
      turn_quarter(V2d(fabrics[material.fabric->fabric].period_mm), transform);
    material.garment_textures.tint *= fits[i].tint;
  }
}

Result<void> wear_variant(int variant, Scene& scene) {
  for (ScenePrimitive& primitive : scene.primitives) {
    primitive.material = primitive.variant_materials[variant];
    if (primitive.material >= static_cast<int>(scene.materials.size()))
      return fail(Code::gltf_accessor, scene.file, primitive.name,
                  fmt::format("variant {} has no material {}", variant, primitive.material));
  }
  return {};
}

bool differ_by_tints(const Scene& a, const Scene& b) {
  return std::ranges::equal(a.primitives, b.primitives,
                            [&](const ScenePrimitive& x, const ScenePrimitive& y) {
                              return seen_material(a, x) == seen_material(b, y);
                            });
}

}  // namespace selvedge
