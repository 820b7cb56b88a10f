#include "format/gltf/unused_parts.h"

#include <algorithm>
#include <array>
#include <functional>
#include <string>
#include <string_view>

#include "format/gltf/access.h"
#include "format/gltf/edit.h"
#include "format/gltf/names.h"

namespace selvedge {
namespace {

using namespace names::gltf;

using Visit = std::function<void(Json&)>;

/// Calls visit(key, value) for everything below `json` but extras.
template <class F>
void walk(Json& json, const F& visit) {
  if (!json.is_structured()) return;
  for (auto it = json.begin(); it != json.end(); ++it) {
    const std::string key = json.is_object() ? it.key() : "";
    if (key == "extras") continue;
    visit(key, *it);
    walk(*it, visit);
  }
}

void visit_index(Json& owner, const char* key, const Visit& visit) {
  if (index_of(member(owner, key)) >= 0) visit(owner[key]);
}

void each_texture(Json& root, const Visit& visit) {
  walk(root, [&](const std::string& key, Json& value) {
    if (key.ends_with("Texture")) visit_index(value, index, visit);
  });
}

/// Sources of textures, also in their extensions.
void each_image(Json& root, const Visit& visit) {
  if (!root.contains("textures")) return;
  walk(root["textures"], [&](const std::string&, Json& value) { visit_index(value, "source", visit); });
}

void each_view(Json& root, const Visit& visit) {
  walk(root, [&](const std::string&, Json& value) { visit_index(value, buffer_view, visit); });
}

void each_entry(Json& list, const Visit& visit) {
  if (!list.is_structured()) return;
  for (Json& entry : list)
    if (index_of(entry) >= 0) visit(entry);
}

/// Accessors of meshes, instances, skins and animations.
void each_accessor(Json& root, const Visit& visit) {
  walk(root, [&](const std::string& key, Json& value) {
    if (key == "targets" && value.is_array())
      for (Json& target : value) each_entry(target, visit);
    if (!value.is_object()) return;
    for (const char* one : {"indices", "inverseBindMatrices", "input", "output"})
      visit_index(value, one, visit);
    // Draco's extension, which has a view, numbers the attributes of a stream.
    if (value.contains("attributes") && !value.contains(buffer_view)) each_entry(value["attributes"], visit);
  });
}

/// Fabrics of materials.
void each_fabric(Json& root, const Visit& visit) {
  if (!root.contains("materials")) return;
  for (Json& material : root["materials"])
    if (member(member(member(material, "extensions"), fabric_extension), fabric).is_object())
      visit_index(material["extensions"][fabric_extension][fabric], index, visit);
}

using Each = void (*)(Json& root, const Visit& visit);

std::set<int> used_by(Json& root, Each each) {
  std::set<int> used;
  each(root, [&](const Json& number) { used.insert(index_of(number)); });
  return used;
}

/// Removes the entries of owner[array] that were `used` and are no longer, and counts the others anew.
void drop(Json& root, Json& owner, const char* array, Each each, const std::set<int>& used) {
  std::set<int> dropped;
  const std::set<int> now = used_by(root, each);
  std::set_difference(used.begin(), used.end(), now.begin(), now.end(),
                      std::inserter(dropped, dropped.end()));
  if (dropped.empty()) return;
  each(root, [&](Json& number) {
    const int before = index_of(number);
    number = before - static_cast<int>(std::distance(dropped.begin(), dropped.lower_bound(before)));
  });
  Json rest = Json::array();
  for (std::size_t i = 0; i < owner[array].size(); ++i)
    if (!dropped.contains(static_cast<int>(i))) rest.push_back(std::move(owner[array][i]));
  if (rest.empty())
    owner.erase(array);
  else
    owner[array] = std::move(rest);
}

/// Whether an extension refers to these parts in the ways above, or not at all.
bool is_known(std::string_view extension) {
  constexpr std::array<std::string_view, 6> known{"EXT_texture_webp",        "EXT_texture_avif",
                                                  "EXT_meshopt_compression", "EXT_mesh_gpu_instancing",
                                                  "MSFT_texture_dds",        fabric_extension};
  return extension.starts_with("KHR_") || std::ranges::find(known, extension) != known.end();
}

}  // namespace

UsedParts used_parts(GltfDocument& document) {
  Json& root = document.json;
  return {used_by(root, each_texture), used_by(root, each_accessor), used_by(root, each_view)};
}

void drop_unused_data(GltfDocument& document, const UsedParts& used) {
  drop(document.json, document.json, "accessors", each_accessor, used.accessors);
  drop(document.json, document.json, "bufferViews", each_view, used.views);
}

void drop_unused_parts(GltfDocument& document, const UsedParts& used) {
  Json& root = document.json;
  const Json& extensions = array_member(root, "extensionsUsed");
  if (!std::ranges::all_of(extensions, [](const Json& extension) { return is_known(string_of(extension)); }))
    return;
  const std::set<int> images = used_by(root, each_image);
  UsedParts data = used;
  data.views.merge(used_by(root, each_view));
  drop(root, root, "textures", each_texture, used.textures);
  drop(root, root, "images", each_image, images);
  for (const char* format : {texture_webp, "EXT_texture_avif", "KHR_texture_basisu", "MSFT_texture_dds"}) {
    const auto has = [&](const Json& texture) {
      return !member(member(texture, "extensions"), format).is_null();
    };
    if (std::ranges::none_of(array_member(root, "textures"), has)) unlist_extension(root, format);
  }
  std::set<int> all;
  const Json& extension = member(member(root, "extensions"), fabric_extension);
  for (std::size_t i = 0; i < array_member(extension, fabrics).size(); ++i) all.insert(static_cast<int>(i));
  if (!all.empty()) drop(root, root["extensions"][fabric_extension], fabrics, each_fabric, all);
  drop_unused_data(document, data);
}

}  // namespace selvedge
