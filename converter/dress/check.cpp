#include "converter/dress/check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "converter/dress/fallback.h"
#include "converter/dress/uv_scale.h"
#include "format/fabric/file.h"
#include "format/picture/image.h"

namespace selvedge {
namespace {

constexpr FallbackOptions coarse{.lights = 64};
/// Tolerance of linear colours; rounding to 8 bits and the separate fit of a level stay well within it.
constexpr float color_tolerance = 0.05F;
/// Stretched cloth stays within this factor.
constexpr double size_tolerance = 1.25;

/// The properties of a fabric that the checks compare.
struct FabricFacts {
  V2f period_mm;
  V3f albedo;
};

std::optional<FabricFacts> known_of(const SceneFabric& source, std::uint64_t memory) {
  const FabricLimits limits{.memory = memory};
  auto reader = source.path.empty() ? FabricReader::open(source.bytes, source.name, limits)
                                    : FabricReader::open(source.path, limits);
  if (!reader) return std::nullopt;
  // The coarsest level is the mean over a repeat.
  const int last = reader->header().levels - 1;
  const Result<Fabric> fabric = reader->read_levels(last, last);
  if (!fabric) return std::nullopt;
  return FabricFacts{fabric->period_mm, mean_color(bake_fallback(*fabric, coarse).base_color)};
}

std::optional<V3f> mean_of(const SceneImage& encoded) {
  const Result<Image> image = decode_image(encoded.bytes, encoded.name, Transfer::srgb);
  return image ? std::optional(mean_color(*image)) : std::nullopt;
}

class DressedCheck {
 public:
  explicit DressedCheck(const Scene& scene) : scene_(scene) {}

  Issues check() {
    for (std::size_t m = 0; m < scene_.materials.size(); ++m) {
      const SceneMaterial& material = scene_.materials[m];
      if (!material.fabric) continue;
      const std::size_t index = material.fabric->fabric;
      if (index >= scene_.fabrics.size()) continue;
      const auto [entry, fresh] = fabrics_.try_emplace(index);
      if (fresh) entry->second = known_of(scene_.fabrics[index], scene_.memory_left);
      if (!entry->second) continue;
      const std::string place = fmt::format("/materials/{}", m);
      check_color(material, *entry->second, place);
      check_size(static_cast<int>(m), *material.fabric, *entry->second, place);
    }
    return std::move(issues_);
  }

 private:
  void check_color(const SceneMaterial& material, const FabricFacts& fabric, const std::string& place) {
    const int index = material.base_color_texture.image;
    // What tints it is beyond the fabric's mean.
    if (index < 0 || material.kept.tint_texture.image >= 0) return;
    const auto [mean, fresh] = means_.try_emplace(index);
    if (fresh) mean->second = mean_of(scene_.images[index]);
    if (!mean->second) return;
    const V4f& factor = material.base_color;
    const V3f shown = *mean->second * V3f(factor.x, factor.y, factor.z);
    // A factor of glTF is at most 1: of the tint on the fabric's own picture, or of both on a mask.
    const bool own_picture = material.kept.mask.image < 0;
    V3f albedo;
    for (int c = 0; c < 3; ++c) {
      const float tint = material.kept.tint[c];
      albedo[c] =
          own_picture ? fabric.albedo[c] * std::min(tint, 1.0F) : std::min(fabric.albedo[c] * tint, 1.0F);
    }
    for (int c = 0; c < 3; ++c) {
      if (std::abs(shown[c] - albedo[c]) <= color_tolerance) continue;
      issues_.push_back(
          {Code::gltf_fallback, scene_.file, place + "/pbrMetallicRoughness/baseColorTexture",
           fmt::format("its mean colour is {:.3f} {:.3f} {:.3f}, the fabric's {:.3f} {:.3f} {:.3f}", shown.x,
                       shown.y, shown.z, albedo.x, albedo.y, albedo.z)});
      return;
    }
  }

  void check_size(int material, const FabricReference& reference, const FabricFacts& fabric,
                  const std::string& place) {
    if (reference.tex_coord > 1) return;
    std::set<int> primitives;
    for (std::size_t i = 0; i < scene_.primitives.size(); ++i) {
      if (scene_.primitives[i].material == material) primitives.insert(static_cast<int>(i));
    }
    const bool placed =
        std::any_of(scene_.instances.begin(), scene_.instances.end(),
                    [&](const SceneInstance& instance) { return primitives.contains(instance.primitive); });
    const UvSize size = measure_uv(scene_, primitives, reference.tex_coord);
    // As dress() refuses it: the cloth is all in one point or line, such as under a node of scale 0.
    if (placed && (!(size.metres.x > 0) || !(size.metres.y > 0))) {
      issues_.push_back(
          {Code::garment_no_uvs, scene_.file, place, "its texture coordinates cover no area in the scene"});
      return;
    }
    // A rotation that is not by a right angle mixes the axes: compare the sizes as an area.
    const V2d scale(std::abs(reference.transform.scale.x), std::abs(reference.transform.scale.y));
    const V2d millimetres(size.metres.x * 1000 / scale.x, size.metres.y * 1000 / scale.y);
    const auto off = [](double ratio) {
      return std::isfinite(ratio) && ratio > 0 && (ratio > size_tolerance || ratio < 1 / size_tolerance);
    };
    const double along_u = millimetres.x / fabric.period_mm.x;
    const double along_v = millimetres.y / fabric.period_mm.y;
    const bool turned = reference.transform.rotation != 0;
    if (turned ? !off(std::sqrt(along_u * along_v)) : !off(along_u) && !off(along_v)) return;
    issues_.push_back(
        {Code::gltf_advice, scene_.file, place,
         fmt::format("a repeat is {:.3g} x {:.3g} mm on the surface; the fabric says {:.3g} x {:.3g}",
                     millimetres.x, millimetres.y, fabric.period_mm.x, fabric.period_mm.y)});
  }

  const Scene& scene_;
  std::map<std::size_t, std::optional<FabricFacts>> fabrics_;
  std::map<int, std::optional<V3f>> means_;  ///< of pictures, each decoded once
  Issues issues_;
};

}  // namespace

Issues check_dressed(const Scene& scene) { return DressedCheck(scene).check(); }

}  // namespace selvedge
