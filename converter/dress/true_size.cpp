#include "converter/dress/true_size.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "converter/dress/uv_scale.h"
#include "format/gltf/access.h"
#include "format/gltf/read_scene.h"

namespace selvedge {
namespace {

/// The nodes that are nobody's children: what a document without scenes shows.
Json roots_of(const Json& nodes) {
  std::set<int> children;
  for (const Json& node : nodes) {
    for (const Json& child : array_of(node, "children")) children.insert(index_of(child));
  }
  Json roots = Json::array();
  for (int i = 0; i < static_cast<int>(nodes.size()); ++i) {
    if (!children.contains(i)) roots.push_back(i);
  }
  return roots;
}

/// Puts a node that scales by `factor` above each root: skins follow, as their joints lie below.
Result<void> scale_scenes(GltfDocument& document, double factor) {
  Json& json = document.json;
  if (array_of(json, "nodes").empty())
    return fail(Code::garment_empty, document.file, "/nodes", "the document has no nodes");
  std::map<int, std::size_t> above;  // by root
  for (const Json& root : roots_of(json["nodes"])) {
    above[index_of(root)] = json["nodes"].size();
    json["nodes"].push_back(
        Json{{"name", "true size"}, {"scale", {factor, factor, factor}}, {"children", {root}}});
  }
  for (std::size_t s = 0; s < array_of(json, "scenes").size(); ++s) {
    for (std::size_t n = 0; n < array_of(json["scenes"][s], "nodes").size(); ++n) {
      Json& node = json["scenes"][s]["nodes"][n];
      const auto found = above.find(index_of(node));
      if (found == above.end())
        return fail(Code::gltf_malformed, document.file, fmt::format("/scenes/{}/nodes/{}", s, n),
                    "the node has a parent");
      node = found->second;
    }
  }
  return {};
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
      return fail(Code::option_out_of_range, document.file, "height", "the garment has no height");
    factor = *height / present;
  }
  if (factor == 1) return {};
  return scale_scenes(document, factor);
}

std::string size_advice(const V3d& size) {
  const double longest = std::max({size.x, size.y, size.z});
  if (!(longest > 0) || (longest >= 0.1 && longest < 2.3)) return "";
  const std::string found = fmt::format("the garment is {:.3g} m long", longest);
  for (const auto& [unit, metres] : {std::pair("cm", 0.01), std::pair("mm", 0.001)}) {
    const double then = longest * metres;
    if (then >= 0.3 && then <= 2.2)
      return fmt::format("{}: --unit {} makes that {:.3g} m", found, unit, then);
  }
  return found + ": --height METRES gives it its true size";
}

}  // namespace selvedge
