#include "converter/dress/true_size.h"

#include "converter/dress/uv_scale.h"
#include "format/gltf/read_scene.h"

namespace selvedge {
namespace {

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

}  // namespace

Result<void> size_garment(GltfDocument& document, double unit, std::optional<double> height,
                          const SceneLimits& limits) {
  double factor = unit;
  if (height) {
    const Result<Scene> scene = read_scene(document, limits);
    if (!scene) return tl::unexpected(scene.error());
    const Imath::Box3d bounds = bounds_of(*scene);
    const double present = bounds.isEmpty() ? 0 : bounds.size().y;
    // A flat cloth that lies down has none but rounding.
    if (!(present > 1e-3 * bounds.size().length()))
      return fail(Code::option_out_of_range, document.file, "height", "the garment has none");
    factor = *height / present;
  }
  if (factor != 1) scale_scenes(document, factor);
  return {};
}

}  // namespace selvedge
