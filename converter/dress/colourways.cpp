#include "converter/dress/colourways.h"

#include <fmt/format.h>

#include <algorithm>

#include "format/gltf/access.h"
#include "format/gltf/edit.h"
#include "format/gltf/fabric_extension.h"
#include "format/gltf/names.h"

namespace selvedge {

using namespace names::gltf;

Result<int> add_variant(GltfDocument& document, const std::string& variant) {
  use_extension(document.json, variants);  // first: a new member of the root moves the others
  Json& all = document.json["extensions"][variants]["variants"];
  for (const Json& present : all) {
    if (string_of(member(present, name)) != variant) continue;
    return fail(Code::option_out_of_range, document.file, "variant",
                fmt::format("the garment has a \"{}\" already", variant));
  }
  all.push_back(Json::object({{name, variant}}));
  return static_cast<int>(all.size()) - 1;
}

int drop_dead_variants(GltfDocument& document) {
  const Json& all = member(member(document.json, "extensions"), variants);
  const std::size_t count = array_of(all, "variants").size();
  int dropped = 0;
  std::set<int> mapped;  // of a primitive
  const auto is_dead = [&](const Json& variant) {
    const int number = index_of(variant);
    const bool dead =
        number < 0 || static_cast<std::size_t>(number) >= count || !mapped.insert(number).second;
    dropped += dead ? 1 : 0;
    return dead;
  };
  for (std::size_t m = 0; m < array_of(document.json, "meshes").size(); ++m) {
    Json& mesh = document.json["meshes"][m];
    for (std::size_t p = 0; p < array_of(mesh, "primitives").size(); ++p) {
      Json& primitive = mesh["primitives"][p];
      if (array_of(member(member(primitive, "extensions"), variants), "mappings").empty()) continue;
      Json alive = Json::array();
      mapped.clear();
      for (Json& mapping : primitive["extensions"][variants]["mappings"]) {
        if (array_of(mapping, "variants").empty()) {
          ++dropped;
          continue;
        }
        Json& shown = mapping["variants"];
        shown.erase(std::remove_if(shown.begin(), shown.end(), is_dead), shown.end());
        if (!shown.empty()) alive.push_back(std::move(mapping));
      }
      if (alive.empty())
        erase_extension(primitive, variants);
      else
        primitive["extensions"][variants]["mappings"] = std::move(alive);
    }
  }
  return dropped;
}

int copy_for_variant(GltfDocument& document, int material, const std::set<Place>& places, int variant) {
  Json& materials = document.json["materials"];
  const int copy = static_cast<int>(materials.size());
  bool worn = false;
  for (const auto& [mesh, number] : places) {
    Json& primitive = document.json["meshes"][mesh]["primitives"][number];
    if (index_of(member(primitive, "material")) != material) continue;
    primitive["extensions"][variants]["mappings"].push_back({{"material", copy}, {"variants", {variant}}});
    worn = true;
  }
  if (!worn) return -1;
  Json entry = materials[material];
  const std::string of_variant =
      string_of(member(document.json["extensions"][variants]["variants"][variant], name));
  const std::string own = string_of(member(entry, name));
  entry[name] = own.empty() ? of_variant : own + " " + of_variant;
  materials.push_back(std::move(entry));
  return copy;
}

V3f tint_towards(const V3f& color, const V3f& albedo) {
  V3f tint(0, 0, 0);
  for (int c = 0; c < 3; ++c) {
    if (color[c] > 0) tint[c] = std::min(color[c] / std::max(albedo[c], 1e-6F), static_cast<float>(max_tint));
  }
  return tint;
}

}  // namespace selvedge
