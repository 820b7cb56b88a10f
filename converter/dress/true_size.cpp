#include "converter/dress/true_size.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <vector>

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

/// Puts a node that scales by `factor` above all that is shown: skins follow, as their joints lie below.
/// Roots that the same scenes show get one node, so that none has two parents.
Result<void> scale_scenes(GltfDocument& document, double factor) {
  Json& json = document.json;
  if (array_of(json, "nodes").empty()) return fail(Code::garment_empty, document.file, "/nodes", "are none");
  Json& nodes = json["nodes"];  // a new member of the root would move the scenes
  const Json roots = roots_of(nodes);
  const auto put_above = [&](const Json& children) {
    nodes.push_back(Json{{"name", "true size"}, {"scale", {factor, factor, factor}}, {"children", children}});
    return nodes.size() - 1;
  };
  if (!json.contains("scenes")) {
    put_above(roots);
    return {};
  }
  std::vector<int> in_order;
  std::map<int, std::set<std::size_t>> scenes_of;  // by root
  for (std::size_t s = 0; s < json["scenes"].size(); ++s) {
    const Json& listed = array_of(json["scenes"][s], "nodes");
    for (std::size_t n = 0; n < listed.size(); ++n) {
      if (!std::binary_search(roots.begin(), roots.end(), listed[n])) {
        return fail(Code::gltf_malformed, document.file, fmt::format("/scenes/{}/nodes/{}", s, n),
                    "the node is no root");
      }
      std::set<std::size_t>& scenes = scenes_of[index_of(listed[n])];
      if (scenes.empty()) in_order.push_back(index_of(listed[n]));
      scenes.insert(s);
    }
    if (!listed.empty()) json["scenes"][s]["nodes"] = Json::array();
  }
  std::map<std::set<std::size_t>, Json> groups;
  for (const int root : in_order) groups[scenes_of[root]].push_back(root);
  for (const auto& [scenes, children] : groups) {
    const std::size_t above = put_above(children);
    for (const std::size_t scene : scenes) json["scenes"][scene]["nodes"].push_back(above);
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
      return fail(Code::option_out_of_range, document.file, "height", "the garment has none");
    factor = *height / present;
  }
  if (factor == 1) return {};
  return scale_scenes(document, factor);
}

}  // namespace selvedge
