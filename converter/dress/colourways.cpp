#include "converter/dress/colourways.h"

#include <fmt/format.h>

#include <algorithm>

#include "converter/dress/fabric_source.h"
#include "format/gltf/access.h"
#include "format/gltf/edit.h"
#include "format/gltf/fabric_extension.h"
#include "format/gltf/names.h"

namespace selvedge {

using namespace names::gltf;

Result<int> add_material_variant(GltfDocument& document, const std::string& variant) {
  list_extension(document.json, variants);  // first: a new member of the root moves the others
  Json& all = document.json["extensions"][variants]["variants"];
  for (const Json& present : all) {
    if (string_of(member(present, name)) != variant) continue;
    return fail(Code::option_out_of_range, document.file, "variant",
                fmt::format("the garment has a \"{}\" already", variant));
  }
  all.push_back(Json::object({{name, variant}}));
  return static_cast<int>(all.size()) - 1;
}

int copy_for_variant(GltfDocument& document, int material, const std::set<PrimitiveIndex>& places,
                     int variant) {
  Json& materials = document.json["materials"];
  const int copy = static_cast<int>(materials.size());
  bool worn = false;
  for (const PrimitiveIndex& place : places) {
    Json& primitive = primitive_at(document, place);
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

V3f tint_for_color(const V3f& color, const V3f& albedo) {
  const float gloss = std::max(min_cloth_luminance - color.dot({0.2126F, 0.7152F, 0.0722F}), 0.0F);
  V3f tint;
  for (int c = 0; c < 3; ++c)
    tint[c] = std::min((color[c] + gloss) / std::max(albedo[c], 1e-6F), static_cast<float>(max_tint));
  return tint;
}

}  // namespace selvedge
