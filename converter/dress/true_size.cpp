#include "converter/dress/true_size.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <vector>

#include "format/gltf/pose.h"

namespace selvedge {

Result<void> scale_garment(GltfDocument& document, double factor) {
  Json& json = document.json;
  if (factor == 1) return {};
  if (array_member(json, "nodes").empty())
    return fail(Code::garment_empty, document.file, "/nodes", "the document has no nodes");
  std::map<int, std::size_t> above;  // by root
  const NodeTransforms transforms(document);
  for (int node = 0, count = static_cast<int>(json["nodes"].size()); node < count; ++node) {
    if (transforms.has_parent(node)) continue;
    above[node] = json["nodes"].size();
    // Skins follow, as their joints lie below.
    json["nodes"].push_back(
        Json{{"name", "true size"}, {"scale", {factor, factor, factor}}, {"children", {node}}});
  }
  for (std::size_t s = 0; s < array_member(json, "scenes").size(); ++s) {
    for (std::size_t n = 0; n < array_member(json["scenes"][s], "nodes").size(); ++n) {
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

std::string size_advice(const V3d& size) {
  const double longest = std::max({size.x, size.y, size.z});
  if (!(longest > 0) || (longest >= 0.1 && longest < 2.3)) return "";
  std::vector<std::string> fits;
  std::string advice = "--height METRES gives it its true size";
  for (const auto& [name, metres] : length_units) {
    if (longest * metres < 0.2 || longest * metres > 2.2) continue;
    fits.push_back(fmt::format("{:.3g} m in {}", longest * metres, name));
    advice = fmt::format("--unit {} makes that {:.3g} m", name, longest * metres);
  }
  if (fits.size() > 1)
    advice = fmt::format("--unit or --height METRES gives it its true size ({})", fmt::join(fits, ", "));
  return fmt::format("the garment is {:.3g} m long: {}", longest, advice);
}

}  // namespace selvedge
