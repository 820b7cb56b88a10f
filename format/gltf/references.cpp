#include "format/gltf/references.h"

#include <fmt/format.h>

#include "format/base/json_text.h"
#include "format/gltf/access.h"
#include "format/gltf/names.h"

namespace selvedge {
namespace {

class ReferenceCheck {
 public:
  ReferenceCheck(const GltfDocument& document, IssueSink& issues) : document_(document), issues_(issues) {}

  void check() {
    const Json& root = document_.json;
    need("scenes", root, "scene", "");
    each(root, "scenes", "",
         [&](const Json& scene, const std::string& place) { need_all("nodes", scene, "nodes", place); });
    each(root, "nodes", "", [&](const Json& node, const std::string& place) {
      need("meshes", node, "mesh", place);
      need("skins", node, "skin", place);
      need("cameras", node, "camera", place);
      need_all("nodes", node, "children", place);
    });
    each(root, "skins", "", [&](const Json& skin, const std::string& place) {
      need("accessors", skin, "inverseBindMatrices", place);
      need("nodes", skin, "skeleton", place);
      need_all("nodes", skin, "joints", place);
    });
    each(root, "meshes", "", [&](const Json& mesh, const std::string& place) {
      each(mesh, "primitives", place, [&](const Json& json, const std::string& at) { primitive(json, at); });
    });
    each(root, "animations", "", [&](const Json& json, const std::string& place) { animation(json, place); });
    each(root, "materials", "",
         [&](const Json& json, const std::string& place) { textures_of(json, place); });
    each(root, "textures", "", [&](const Json& texture, const std::string& place) {
      need("images", texture, "source", place);
      need("samplers", texture, "sampler", place);
    });
    each(root, "images", "", [&](const Json& image, const std::string& place) {
      need("bufferViews", image, names::gltf::buffer_view, place);
    });
    each(root, "accessors", "", [&](const Json& accessor, const std::string& place) {
      need("bufferViews", accessor, names::gltf::buffer_view, place);
      for (const char* part : {"indices", "values"}) {
        need("bufferViews", member(member(accessor, "sparse"), part), names::gltf::buffer_view,
             fmt::format("{}/sparse/{}", place, part));
      }
    });
    for (std::size_t i = 0; i < array_of(root, "bufferViews").size(); ++i) {
      GltfReader reader(document_);
      reader.view(static_cast<int>(i), fmt::format("/bufferViews/{}", i));
      if (reader.fault) issues_.add(*reader.fault);
    }
  }

 private:
  /// visit(item, its place) for the items of a list of `owner`.
  template <class F>
  static void each(const Json& owner, const char* list, const std::string& place, const F& visit) {
    const Json& items = array_of(owner, list);
    for (std::size_t i = 0; i < items.size(); ++i) visit(items[i], fmt::format("{}/{}/{}", place, list, i));
  }

  void need(const char* array, const Json& number, const std::string& place) {
    GltfReader reader(document_);
    reader.entry(array, index_of(number), place);
    if (reader.fault) issues_.add(*reader.fault);
  }

  /// A member may be absent.
  void need(const char* array, const Json& owner, const char* key, const std::string& place) {
    const Json& number = member(owner, key);
    if (!number.is_null()) need(array, number, fmt::format("{}/{}", place, key));
  }

  void need_all(const char* array, const Json& owner, const char* list, const std::string& place) {
    each(owner, list, place, [&](const Json& number, const std::string& at) { need(array, number, at); });
  }

  void attributes(const Json& json, const std::string& place) {
    if (!json.is_object()) return;
    for (auto it = json.begin(); it != json.end(); ++it)
      if (!it->is_null()) need("accessors", *it, pointer_to(place, it.key()));
  }

  void primitive(const Json& json, const std::string& place) {
    attributes(member(json, "attributes"), place + "/attributes");
    each(json, "targets", place, [&](const Json& target, const std::string& at) { attributes(target, at); });
    need("accessors", json, "indices", place);
    need("materials", json, "material", place);
    each(member(member(json, "extensions"), names::gltf::variants), "mappings",
         fmt::format("{}/extensions/{}", place, names::gltf::variants),
         [&](const Json& mapping, const std::string& at) {
           need("materials", member(mapping, "material"), at + "/material");
         });
  }

  void animation(const Json& json, const std::string& place) {
    const auto samplers = static_cast<int>(array_of(json, "samplers").size());
    each(json, "channels", place, [&](const Json& channel, const std::string& at) {
      const Json& sampler = member(channel, "sampler");
      const int number = index_of(sampler);
      if (!sampler.is_null() && (number < 0 || number >= samplers))
        issues_.add(Code::gltf_accessor, at + "/sampler",
                    fmt::format("there is no {}/samplers/{}", place, number));
      need("nodes", member(channel, "target"), "node", at + "/target");
    });
    each(json, "samplers", place, [&](const Json& sampler, const std::string& at) {
      need("accessors", sampler, "input", at);
      need("accessors", sampler, "output", at);
    });
  }

  void textures_of(const Json& json, const std::string& place) {
    if (!json.is_structured()) return;
    for (auto it = json.begin(); it != json.end(); ++it) {
      // The fabric's extension has rules of its own (check_fabric_extension).
      if (json.is_object() && (it.key() == "extras" || it.key() == names::gltf::fabric_extension)) continue;
      const std::string at =
          json.is_object() ? pointer_to(place, it.key()) : fmt::format("{}/{}", place, it - json.begin());
      if (json.is_object() && it.key().ends_with("Texture")) need("textures", *it, names::gltf::index, at);
      textures_of(*it, at);
    }
  }

  const GltfDocument& document_;
  IssueSink& issues_;
};

}  // namespace

void check_references(const GltfDocument& document, IssueSink& issues) {
  ReferenceCheck(document, issues).check();
}

}  // namespace selvedge
