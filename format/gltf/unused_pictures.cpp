#include "format/gltf/unused_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <string_view>
#include <vector>

#include "format/gltf/access.h"
#include "format/gltf/edit.h"
#include "format/gltf/names.h"
#include "format/gltf/uri.h"

namespace selvedge {
namespace {

/// Calls visit(index, a number) for every reference to a texture.
template <class F>
void each_texture(Json& json, const F& visit) {
  if (!json.is_structured()) return;
  for (auto it = json.begin(); it != json.end(); ++it) {
    const std::string key = json.is_object() ? it.key() : std::string();
    if (key == "extras") continue;
    if (key.ends_with("Texture") && index_of(member(*it, names::gltf::index)) >= 0)
      visit((*it)[names::gltf::index]);
    each_texture(*it, visit);
  }
}

/// The same of pictures: sources of textures, also in their extensions, and lights of EXT_lights_image_based.
template <class F>
void each_image(Json& root, const F& visit) {
  const auto visit_source = [&](Json& owner) {
    if (index_of(member(owner, "source")) >= 0) visit(owner["source"]);
  };
  if (root.contains("textures")) {
    for (Json& texture : root["textures"]) {
      visit_source(texture);
      if (!member(texture, "extensions").is_object()) continue;
      for (Json& extension : texture["extensions"]) visit_source(extension);
    }
  }
  const Json& lit = member(member(root, "extensions"), "EXT_lights_image_based");
  if (!member(lit, "lights").is_array()) return;
  for (Json& light : root["extensions"]["EXT_lights_image_based"]["lights"]) {
    if (!member(light, "specularImages").is_array()) continue;
    for (Json& level : light["specularImages"]) {
      for (Json& image : level) visit(image);
    }
  }
}

/// The same of fabrics, whose mirrors are in extras.
template <class F>
void each_fabric(Json& root, const F& visit) {
  if (!root.contains("materials")) return;
  for (Json& material : root["materials"]) {
    const Json& worn =
        member(member(member(material, "extensions"), names::gltf::fabric_extension), "fabric");
    if (index_of(member(worn, names::gltf::index)) >= 0)
      visit(material["extensions"][names::gltf::fabric_extension]["fabric"][names::gltf::index]);
    const Json& mirror = member(member(material, "extras"), names::gltf::fabric_extension);
    if (index_of(member(mirror, names::gltf::index)) >= 0)
      visit(material["extras"][names::gltf::fabric_extension][names::gltf::index]);
  }
}

template <class F>
void each_sampler(Json& root, const F& visit) {
  if (!root.contains("textures")) return;
  for (Json& texture : root["textures"]) {
    if (index_of(member(texture, "sampler")) >= 0) visit(texture["sampler"]);
  }
}

template <class F>
void each_view(Json& json, const F& visit) {
  if (!json.is_structured()) return;
  for (auto it = json.begin(); it != json.end(); ++it) {
    if (json.is_object() && it.key() == "extras") continue;
    if (json.is_object() && it.key() == names::gltf::buffer_view && index_of(*it) >= 0)
      visit(*it);
    else
      each_view(*it, visit);
  }
}

template <class Each>
std::set<int> used_by(Json& root, const Each& each) {
  std::set<int> used;
  each(root, [&](const Json& index) { used.insert(index_of(index)); });
  return used;
}

/// Removes entries of an array of `owner` and counts all references anew.
template <class Each>
void drop(Json& root, Json& owner, const char* array, const std::set<int>& dropped, const Each& each) {
  if (dropped.empty()) return;
  each(root, [&](Json& index) {
    const int before = index_of(index);
    const auto gone = std::distance(dropped.begin(), dropped.lower_bound(before));
    if (!dropped.contains(before)) index = before - static_cast<int>(gone);
  });
  Json rest = Json::array();
  for (std::size_t i = 0; i < owner[array].size(); ++i) {
    if (!dropped.contains(static_cast<int>(i))) rest.push_back(std::move(owner[array][i]));
  }
  if (rest.empty())
    owner.erase(array);
  else
    owner[array] = std::move(rest);
}

std::set<int> without(const std::set<int>& all, const std::set<int>& others) {
  std::set<int> rest;
  std::set_difference(all.begin(), all.end(), others.begin(), others.end(), std::inserter(rest, rest.end()));
  return rest;
}

bool is_known(std::string_view extension) {
  constexpr std::array<std::string_view, 8> known{
      "EXT_texture_webp",       "EXT_texture_avif", "EXT_meshopt_compression", "EXT_mesh_gpu_instancing",
      "EXT_lights_image_based", "EXT_lights_ies",   "MSFT_texture_dds",        names::gltf::fabric_extension};
  return extension.starts_with("KHR_") || std::find(known.begin(), known.end(), extension) != known.end();
}

/// An extension that may refer to textures or pictures in ways of its own; "" without one.
std::string unknown_extension(const Json& root) {
  for (const Json& extension : array_of(root, "extensionsUsed")) {
    if (!is_known(string_of(extension))) return string_of(extension);
  }
  return "";
}

/// Removes the members that refer to one of the textures. What glowed by a texture glows no more.
void erase_references(Json& json, const std::set<int>& textures) {
  if (!json.is_structured()) return;
  bool dark = false;
  for (auto it = json.begin(); it != json.end();) {
    const bool gone = json.is_object() && it.key().ends_with("Texture") &&
                      textures.contains(index_of(member(*it, names::gltf::index)));
    if (!gone && !(json.is_object() && it.key() == "extras")) erase_references(*it, textures);
    dark |= gone && it.key() == "emissiveTexture";
    it = gone ? json.erase(it) : std::next(it);
  }
  if (dark) json.erase("emissiveFactor");
}

/// Why a picture cannot be shown; "" if it can, or where nobody here can tell: it lies on the network, or an
/// extension has it.
std::string fault_of_picture(const GltfDocument& document, int image) {
  const Json& entry = entry_of(document, "images", image);
  if (!entry.contains(names::gltf::uri) && !entry.contains(names::gltf::buffer_view)) return "";
  const Result<void> good = check_image_bytes(document, image);
  if (good || good.error().code == Code::gltf_unsupported) return "";
  const std::string address = string_of(member(entry, names::gltf::uri));
  const bool is_file = !address.empty() && !address.starts_with("data:");
  const std::string what = is_file ? address.substr(0, 200) : fmt::format("/images/{}", image);
  return good.error().code == Code::file_missing       ? what + " is not there"
         : good.error().code == Code::image_unreadable ? what + " " + good.error().message
                                                       : what + " cannot be read";
}

/// Removes what names one of the pictures from a texture, and extensions such as EXT_texture_webp that do.
/// Whether there was something, and nothing else names a picture.
bool lose_sources(Json& texture, const std::set<int>& images) {
  const auto is_lost = [&](const Json& owner) { return images.contains(index_of(member(owner, "source"))); };
  std::vector<std::string> lost;
  bool has_other = false;
  const Json& extensions = member(texture, "extensions");
  for (auto it = extensions.begin(); extensions.is_object() && it != extensions.end(); ++it) {
    if (is_lost(*it)) lost.push_back(it.key());
    has_other |= !is_lost(*it) && index_of(member(*it, "source")) >= 0;
  }
  for (const std::string& name : lost) erase_extension(texture, name.c_str());
  const bool own_is_lost = is_lost(texture);
  if (own_is_lost) texture.erase("source");
  has_other |= index_of(member(texture, "source")) >= 0;
  return (own_is_lost || !lost.empty()) && !has_other;
}

/// Removes those of the textures and of the pictures that nothing uses, with the pictures, samplers and views
/// that only these used. Returns the pictures that were removed.
std::set<int> drop_without_use(Json& root, const std::set<int>& of_textures, std::set<int> of_images) {
  const auto textures = [](Json& of, const auto& visit) { each_texture(of, visit); };
  const auto images = [](Json& of, const auto& visit) { each_image(of, visit); };
  const auto samplers = [](Json& of, const auto& visit) { each_sampler(of, visit); };
  const auto views = [](Json& of, const auto& visit) { each_view(of, visit); };
  of_images.merge(used_by(root, images));
  const std::set<int> samplers_before = used_by(root, samplers);
  drop(root, root, "textures", without(of_textures, used_by(root, textures)), textures);
  drop(root, root, "samplers", without(samplers_before, used_by(root, samplers)), samplers);
  std::set<int> images_unused = without(of_images, used_by(root, images));
  const std::set<int> views_before = used_by(root, views);
  drop(root, root, "images", images_unused, images);
  drop(root, root, "bufferViews", without(views_before, used_by(root, views)), views);
  return images_unused;
}

/// Removes the fabrics that no material wears, with their views.
void drop_unworn_fabrics(Json& root) {
  const auto fabrics = [](Json& of, const auto& visit) { each_fabric(of, visit); };
  const auto views = [](Json& of, const auto& visit) { each_view(of, visit); };
  const std::set<int> worn = used_by(root, fabrics);
  if (worn.empty()) return;
  Json& extension = root["extensions"][names::gltf::fabric_extension];
  std::set<int> all;
  for (std::size_t i = 0; i < array_of(extension, names::gltf::fabrics).size(); ++i)
    all.insert(static_cast<int>(i));
  const std::set<int> views_before = used_by(root, views);
  drop(root, extension, names::gltf::fabrics, without(all, worn), fabrics);
  drop(root, root, "bufferViews", without(views_before, used_by(root, views)), views);
}

}  // namespace

std::set<int> textures_in_use(const Json& json) {
  Json copy = json;  // the visitor may write
  return used_by(copy, [](Json& root, const auto& visit) { each_texture(root, visit); });
}

std::string drop_unused_pictures(GltfDocument& document, const std::set<int>& used) {
  std::string unknown = unknown_extension(document.json);
  if (unknown.empty()) {
    drop_without_use(document.json, used, {});
    drop_unworn_fabrics(document.json);
  }
  return unknown;
}

Result<std::vector<std::string>> drop_missing_pictures(GltfDocument& document) {
  std::map<int, std::string> faults;  // by picture
  std::set<int> images;
  for (int i = 0; i < static_cast<int>(array_of(document.json, "images").size()); ++i) {
    const std::string fault = fault_of_picture(document, i);
    if (fault.empty()) continue;
    faults[i] = fault;
    images.insert(i);
  }
  std::set<int> textures =
      used_by(document.json, [](Json& root, const auto& visit) { each_texture(root, visit); });
  const auto there = static_cast<int>(array_of(document.json, "textures").size());
  textures.erase(textures.begin(), textures.lower_bound(there));
  if (images.empty() && textures.empty()) return std::vector<std::string>();
  const std::string unknown = unknown_extension(document.json);
  if (!unknown.empty()) {
    if (images.empty()) return std::vector<std::string>();
    return fail(
        Code::gltf_reference, document.file, fmt::format("/images/{}", *images.begin()),
        fmt::format("{}, and cannot be left out: {} may refer to it", faults[*images.begin()], unknown));
  }
  std::vector<std::string> remarks;
  for (const int texture : textures) remarks.push_back(fmt::format("/textures/{} is not there", texture));
  for (std::size_t i = 0; i < array_of(document.json, "textures").size(); ++i) {
    if (lose_sources(document.json["textures"][i], images)) textures.insert(static_cast<int>(i));
  }
  erase_references(document.json, textures);
  const std::set<int> dropped = drop_without_use(document.json, textures, images);
  for (const auto& [image, fault] : faults) {
    if (!dropped.contains(image)) {
      return fail(Code::gltf_reference, document.file, fmt::format("/images/{}", image),
                  fault + ", and a light needs it");
    }
    remarks.push_back(fault);
  }
  return remarks;
}

}  // namespace selvedge
