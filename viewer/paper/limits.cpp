#include "viewer/paper/limits.h"

#include <fmt/format.h>

#include <algorithm>

#include "viewer/paper/coding.h"

namespace selvedge {
namespace {

tl::unexpected<Error> refuse(const std::string& file, const std::string& reason) {
  return fail(Code::option_out_of_range, file, "--path",
              fmt::format("paper: {}; --path hybrid draws it", reason));
}

/// The reason why the paper's path cannot draw a fabric; empty if it can.
std::string beyond_paper(const Fabric& fabric) {
  const FabricLevel& finest = fabric.levels.front();
  if (finest.width > paper_side_limit || finest.height > paper_side_limit) {
    return fmt::format("{} x {} texels; positions of 8 bits name {} a side", finest.width, finest.height,
                       paper_side_limit);
  }
  for (const FabricLevel& level : fabric.levels) {
    if (level.has(LayerKind::light)) return "the fabric has a light table, which is not in the paper's model";
    if (level.has(LayerKind::products)) return "the fabric has products, which are not in the paper's model";
  }
  return {};
}

}  // namespace

Result<PaperKinds> paper_kinds(const Scene& scene, const std::vector<Surface>& surfaces,
                               const Materials& materials, const std::vector<Fabric>& fabrics,
                               std::vector<std::string>& remarks) {
  const auto material_name = [&](const Surface& surface) -> std::string {
    if (surface.material < 0) return "the default material";
    return fmt::format("material \"{}\"", scene.materials[surface.material].name);
  };
  PaperKinds result;
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const SurfaceMaterial& material = materials.surfaces[i];
    if (material.fabric < 0)
      return refuse(scene.file, material_name(surfaces[i]) + " has no fabric, and cloth is all it draws");
    SurfaceMaterial kind;
    kind.fabric = material.fabric;
    kind.keeps_opacity = material.keeps_opacity;
    const auto found =
        std::find_if(result.kinds.begin(), result.kinds.end(), [&](const SurfaceMaterial& other) {
          return other.fabric == kind.fabric && other.keeps_opacity == kind.keeps_opacity;
        });
    result.of_surfaces.push_back(static_cast<int>(found - result.kinds.begin()));
    if (found == result.kinds.end()) result.kinds.push_back(kind);
    const PbrMaterial& pbr = materials.pbr[i];
    const std::string line = fmt::format(
        "{}: {}: --path paper draws neither its occlusion, its emission, nor its mask, normals or tint",
        scene.file, material_name(surfaces[i]));
    const bool has_more = pbr.occlusion.image >= 0 || pbr.emissive != V3f(0, 0, 0) || material.tinted ||
                          material.bends || pbr.metallic_roughness.image >= 0;
    if (has_more && std::find(remarks.begin(), remarks.end(), line) == remarks.end()) remarks.push_back(line);
  }
  if (result.kinds.size() > static_cast<std::size_t>(paper_kind_limit)) {
    return refuse(scene.file, fmt::format("{} kinds of cloth; an alpha of 8 bits tells {} apart",
                                          result.kinds.size(), paper_kind_limit));
  }
  for (std::size_t i = 0; i < fabrics.size(); ++i) {
    const bool used = std::any_of(result.kinds.begin(), result.kinds.end(), [&](const SurfaceMaterial& kind) {
      return kind.fabric == static_cast<int>(i);
    });
    if (!used) continue;
    const std::string& name = i < scene.fabrics.size() ? scene.fabrics[i].name : scene.file;
    if (const std::string reason = beyond_paper(fabrics[i]); !reason.empty()) return refuse(name, reason);
    if (fabrics[i].levels.front().yarns())
      remarks.push_back(fmt::format("{}: --path paper draws level 0 in place of the yarn", name));
  }
  return result;
}

Result<void> check_paper_lights(std::span<const Light> lights) {
  const bool far = std::all_of(lights.begin(), lights.end(),
                               [](const Light& light) { return light.kind == LightKind::directional; });
  if (!far) return refuse({}, "point and spot lights need the pixel's place, which its frames do not have");
  return {};
}

int finest_for_paper(int finest) {
  // OpenGL's level may differ by half a level from the formula's; the rest allows for rounding in drivers.
  const int level = std::max(finest - 1, 0);
  return level - level % 2;
}

int coarsest_for_paper(int coarsest, int levels) { return std::min(coarsest + 1, levels - 1); }

}  // namespace selvedge
