#include "converter/dress/extras_mirror.h"

#include <fmt/format.h>

#include "format/gltf/access.h"
#include "format/gltf/names.h"

namespace selvedge {

using namespace names::gltf;

std::optional<Placement> base_color_placement(const GltfDocument& document, int material) {
  const Json& json = member(document.json, "materials")[material];
  const Json& info = member(member(json, "pbrMetallicRoughness"), base_color_texture);
  if (!info.is_object()) return std::nullopt;
  return placement_of(info);
}

void complete_mirror(GltfDocument& document, int material, const std::string& digest_of_file) {
  const std::optional<Placement> base = base_color_placement(document, material);
  Json& json = document.json["materials"][material];
  if (member(member(json, "extras"), fabric_extension).is_null()) return;
  Json& mirror = json["extras"][fabric_extension];
  mirror[digest] = digest_of_file;
  for (const char* part : {mask_cutoff, tint_factor}) {
    if (const Json& value = part_of(document, material, part); !value.is_null()) mirror[part] = value;
  }
  for (const char* part : {mask_texture, normal_texture, tint_texture}) {
    if (part_of(document, material, part).is_object()) mirror[kept].push_back(part);
  }
  if (base && *base == placement_of(mirror)) return;
  mirror[base_color_texture] = base ? texture_info(0, base->tex_coord, base->transform) : Json();
  if (base) mirror[base_color_texture].erase(index);
}

std::vector<std::string> restore_parts(GltfDocument& document, int material, const Mirror& mirror) {
  Json& json = document.json["materials"][material];
  Json& extension = json["extensions"][fabric_extension];
  std::vector<std::string> gone;
  for (const auto& [part, value] : mirror.parts.items()) {
    if (part != kept) extension[part] = value;
  }
  for (const Json& name_of_part : array_of(mirror.parts, kept)) {
    const std::string part = string_of(name_of_part);
    const Json info = part == normal_texture
                          ? member(json, normal_texture)
                          : member(member(json, "pbrMetallicRoughness"), base_color_texture);
    if (info.is_object())
      extension[part] = info;
    else
      gone.push_back(part);
  }
  return gone;
}

Result<std::optional<Mirror>> read_mirror(const GltfDocument& document, int material) {
  const Json& json = member(document.json, "materials")[material];
  const Json& extras = member(json, "extras");
  const Json& stored = member(extras, fabric_extension);
  if (stored.is_null()) return std::optional<Mirror>();
  const std::string place = fmt::format("/materials/{}/extras/{}", material, fabric_extension);
  if (!stored.is_object()) return fail(Code::gltf_extension, document.file, place, "is not an object");
  Mirror mirror;
  for (const auto& [key, value] :
       {std::pair(name, &mirror.name), std::pair(uri, &mirror.uri), std::pair(digest, &mirror.digest)}) {
    const Json& text = member(stored, key);
    if (!text.is_null() && !text.is_string()) {
      return fail(Code::gltf_extension, document.file, fmt::format("{}/{}", place, key), "is not a string");
    }
    if (text.is_string()) *value = text.get<std::string>();
  }
  if (mirror.name.empty() && mirror.uri.empty() && mirror.digest.empty()) {
    return fail(Code::gltf_extension, document.file, place, "names no fabric");
  }
  mirror.fabric = placement_of(stored);
  mirror.parts = Json::object();
  for (const char* part : {mask_cutoff, tint_factor}) {
    if (stored.contains(part)) mirror.parts[part] = stored[part];
  }
  for (const Json& part : array_of(stored, kept)) {
    for (const char* known : {mask_texture, normal_texture, tint_texture}) {
      if (part == known) mirror.parts[kept].push_back(known);
    }
  }
  if (!stored.contains(base_color_texture)) {
    mirror.base_color = mirror.fabric;
  } else if (stored[base_color_texture].is_object()) {
    mirror.base_color = placement_of(stored[base_color_texture]);
  }
  return std::optional(std::move(mirror));
}

std::optional<Placement> placement_now(const Mirror& mirror, const std::optional<Placement>& base_color) {
  if (!mirror.base_color || !base_color) return std::nullopt;
  if (mirror.base_color->tex_coord != mirror.fabric.tex_coord) return std::nullopt;
  if (mirror.base_color->transform == mirror.fabric.transform) return base_color;
  const UvTransform& before = mirror.base_color->transform;
  const UvTransform& now = base_color->transform;
  const bool scales = before.scale.x != 0 && before.scale.y != 0;
  if (!scales || before.rotation != now.rotation) return std::nullopt;
  // now = before(D(uv)), where D(uv) = scale uv + offset decodes the new coordinates; the fabric's new
  // transform is its old one after D.
  const V2d decoding(now.scale.x / before.scale.x, now.scale.y / before.scale.y);
  UvTransform turn_back;
  turn_back.rotation = -before.rotation;
  const V2d moved = turn_back.apply_linear(now.offset - before.offset);
  const V2d shift(moved.x / before.scale.x, moved.y / before.scale.y);
  Placement placement{base_color->tex_coord, mirror.fabric.transform};
  placement.transform.offset = mirror.fabric.transform.apply(shift);
  placement.transform.scale =
      V2d(mirror.fabric.transform.scale.x * decoding.x, mirror.fabric.transform.scale.y * decoding.y);
  return placement;
}

}  // namespace selvedge
