#include "format/gltf/references.h"

#include <fmt/format.h>

#include <array>
#include <set>
#include <string_view>

#include "format/base/guard.h"
#include "format/base/json_text.h"
#include "format/gltf/access.h"
#include "format/gltf/names.h"

namespace selvedge {
namespace {

/// Where a document has numbers, and of which root array or of variants; "*": every item or member.
struct Reference {
  std::string_view path;
  const char* array;
};
constexpr std::array references{
    Reference{"/scene", "scenes"},
    Reference{"/scenes/*/nodes/*", "nodes"},
    Reference{"/nodes/*/mesh", "meshes"},
    Reference{"/nodes/*/skin", "skins"},
    Reference{"/nodes/*/camera", "cameras"},
    Reference{"/nodes/*/children/*", "nodes"},
    Reference{"/skins/*/inverseBindMatrices", "accessors"},
    Reference{"/skins/*/skeleton", "nodes"},
    Reference{"/skins/*/joints/*", "nodes"},
    Reference{"/meshes/*/primitives/*/attributes/*", "accessors"},
    Reference{"/meshes/*/primitives/*/targets/*/*", "accessors"},
    Reference{"/meshes/*/primitives/*/indices", "accessors"},
    Reference{"/meshes/*/primitives/*/material", "materials"},
    Reference{"/meshes/*/primitives/*/extensions/KHR_materials_variants/mappings/*/material", "materials"},
    Reference{"/meshes/*/primitives/*/extensions/KHR_materials_variants/mappings/*/variants/*", "variants"},
    Reference{"/animations/*/channels/*/target/node", "nodes"},
    Reference{"/animations/*/samplers/*/input", "accessors"},
    Reference{"/animations/*/samplers/*/output", "accessors"},
    Reference{"/textures/*/source", "images"},
    Reference{"/textures/*/extensions/EXT_texture_webp/source", "images"},
    Reference{"/textures/*/sampler", "samplers"},
    Reference{"/images/*/bufferView", "bufferViews"},
    Reference{"/accessors/*/bufferView", "bufferViews"},
    Reference{"/accessors/*/sparse/indices/bufferView", "bufferViews"},
    Reference{"/accessors/*/sparse/values/bufferView", "bufferViews"},
};

class ReferenceCheck {
 public:
  ReferenceCheck(const GltfDocument& document, IssueSink& issues) : document_(document), issues_(issues) {}

  void check() {
    for (const Reference& reference : references) follow(document_.json, reference.path, "", reference.array);
    check_tree();
    const Json& animations = array_member(document_.json, "animations");
    for (std::size_t i = 0; i < animations.size(); ++i) {
      const std::string place = fmt::format("/animations/{}", i);
      const Json& channels = array_member(animations[i], "channels");
      for (std::size_t k = 0; k < channels.size(); ++k)
        need(animations[i], "samplers", member(channels[k], "sampler"),
             fmt::format("{}/channels/{}/sampler", place, k), place);
    }
    const Json& materials = array_member(document_.json, "materials");
    for (std::size_t i = 0; i < materials.size(); ++i)
      check_textures(materials[i], fmt::format("/materials/{}", i));
    for (std::size_t i = 0; i < array_member(document_.json, "bufferViews").size(); ++i) {
      const auto good = catch_failure(
          [&] { GltfReader(document_).buffer_view(static_cast<int>(i), fmt::format("/bufferViews/{}", i)); });
      if (!good) issues_.add(good.error());
    }
  }

 private:
  /// A number of `owner`'s array, which lies at `array_place`. It may be absent or null.
  void need(const Json& owner, const char* array, const Json& number, const std::string& place,
            const std::string& array_place) {
    if (number.is_null()) return;
    const int index = index_of(number);
    if (index < 0 || static_cast<std::size_t>(index) >= array_member(owner, array).size())
      issues_.add(Code::gltf_accessor, place, fmt::format("there is no {}/{}/{}", array_place, array, index));
  }

  void need(const char* array, const Json& number, const std::string& place) {
    const bool variant = array == std::string_view("variants");
    need(variant ? member(member(document_.json, "extensions"), names::gltf::variants) : document_.json,
         array, number, place, "");
  }

  /// A node has one parent at most, and a scene's node none.
  void check_tree() {
    const Json& nodes = array_member(document_.json, "nodes");
    std::vector<int> parents(nodes.size());
    const auto reach = [&](int index) {
      if (index < 0 || static_cast<std::size_t>(index) >= parents.size() || parents[index]++ == 0) return;
      issues_.add(Code::gltf_malformed, fmt::format("/nodes/{}", index), "the node is reached twice");
    };
    for (const Json& node : nodes)
      for (const Json& child : array_member(node, "children")) reach(index_of(child));
    std::set<int> roots;
    for (const Json& scene : array_member(document_.json, "scenes"))
      for (const Json& node : array_member(scene, "nodes")) roots.insert(index_of(node));
    for (const int root : roots) reach(root);
  }

  /// Checks the numbers at `path` below `json`, which lies at `place`.
  void follow(const Json& json, std::string_view path, const std::string& place, const char* array) {
    if (path.empty()) return need(array, json, place);
    const std::size_t end = std::min(path.find('/', 1), path.size());
    const std::string key(path.substr(1, end - 1));
    const std::string_view rest = path.substr(end);
    if (key != "*") return follow(member(json, key.c_str()), rest, place + "/" + key, array);
    if (!json.is_structured()) return;
    for (const auto& [name, child] : json.items()) follow(child, rest, member_pointer(place, name), array);
  }

  void check_textures(const Json& json, const std::string& place) {
    if (!json.is_structured()) return;
    for (const auto& [key, child] : json.items()) {
      if (key == "extras" || key == names::gltf::fabric_extension) continue;
      const std::string at = member_pointer(place, key);
      if (key.ends_with("Texture")) need("textures", member(child, names::gltf::index), at + "/index");
      check_textures(child, at);
    }
  }

  const GltfDocument& document_;
  IssueSink& issues_;
};

}  // namespace

void check_references(const GltfDocument& document, IssueSink& issues) {
  ReferenceCheck(document, issues).check();
}

Result<void> check_references(const GltfDocument& document) {
  IssueSink issues(document.file);
  check_references(document, issues);
  if (issues.has_error()) return tl::unexpected(issues.first_error());
  return catch_failure([&] {
    for (std::size_t i = 0; i < array_member(document.json, "bufferViews").size(); ++i)
      GltfReader(document).view_bytes(static_cast<int>(i), fmt::format("/bufferViews/{}", i));
  });
}

}  // namespace selvedge
