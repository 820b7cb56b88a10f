#include "format/gltf_scene.h"

#include <Imath/ImathMatrix.h>
#include <Imath/ImathQuat.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "format/gltf_access.h"
#include "format/gltf_fabric.h"
#include "format/gltf_geometry.h"

namespace selvedge {
namespace {

std::string text_of(const Json& value) {
  return value.is_string() ? value.get<std::string>() : std::string();
}

class Reader {
 public:
  Reader(const GltfDocument& document, const SceneLimits& limits) : document_(document), limits_(limits) {
    limits_.vertices = std::min(limits_.vertices, unbacked_elements(document));
  }

  Result<Scene> read() {
    scene_.file = document_.file;
    for (Result<void> (Reader::*step)() : {&Reader::read_materials, &Reader::read_nodes}) {
      if (Result<void> good = (this->*step)(); !good) return tl::unexpected<Error>(std::move(good.error()));
    }
    remark_on_what_is_not_read();
    return std::move(scene_);
  }

 private:
  tl::unexpected<Error> malformed(std::string place, std::string message) const {
    return fail(Code::gltf_malformed, document_.file, std::move(place), std::move(message));
  }

  void remark(std::string text) {
    constexpr std::size_t most = 100;
    if (scene_.remarks.size() >= most) return;
    if (std::find(scene_.remarks.begin(), scene_.remarks.end(), text) == scene_.remarks.end()) {
      scene_.remarks.push_back(std::move(text));
    }
  }

  Result<void> read_materials() {
    Result<std::vector<SceneFabric>> fabrics = read_fabrics(document_);
    if (!fabrics) return tl::unexpected<Error>(std::move(fabrics.error()));
    scene_.fabrics = std::move(*fabrics);
    const Json& materials = member(document_.json, "materials");
    for (std::size_t i = 0; materials.is_array() && i < materials.size(); ++i) {
      const Json& json = materials[i];
      SceneMaterial material;
      material.name = text_of(member(json, "name"));
      const Json& pbr = member(json, "pbrMetallicRoughness");
      const Json& factor = member(pbr, "baseColorFactor");
      for (std::size_t c = 0; factor.is_array() && c < 4 && c < factor.size(); ++c) {
        material.base_color[static_cast<int>(c)] = static_cast<float>(number_of(factor[c], 1));
      }
      material.base_color_texture = read_texture(member(pbr, "baseColorTexture"));
      const std::string mode = text_of(member(json, "alphaMode"));
      material.alpha_mode = mode == "MASK"    ? AlphaMode::mask
                            : mode == "BLEND" ? AlphaMode::blend
                                              : AlphaMode::opaque;
      material.alpha_cutoff = static_cast<float>(number_of(member(json, "alphaCutoff"), 0.5));
      material.double_sided = member(json, "doubleSided") == true;
      auto reference =
          read_fabric_reference(document_, static_cast<int>(i), static_cast<int>(scene_.fabrics.size()));
      if (!reference) return tl::unexpected<Error>(std::move(reference.error()));
      material.fabric = std::move(*reference);
      scene_.materials.push_back(std::move(material));
    }
    return {};
  }

  /// Pictures are not worth refusing a garment for: what cannot be had is remarked.
  TextureReference read_texture(const Json& info) {
    TextureReference texture;
    if (info.is_null()) return texture;
    texture.tex_coord = std::max(0, index_of(member(info, "texCoord")));
    texture.transform = read_uv_transform(info, texture.tex_coord);
    const auto json = entry_of(document_, "textures", index_of(member(info, "index")), "");
    if (!json) {
      remark(json.error().message);
      return texture;
    }
    texture.image = read_image(index_of(member(**json, "source")));
    return texture;
  }

  int read_image(int index) {
    const auto known = images_.find(index);
    if (known != images_.end()) return known->second;
    const std::string place = fmt::format("/images/{}", index);
    int result = -1;
    if (const auto json = entry_of(document_, "images", index, place); !json) {
      remark(json.error().message);
    } else {
      SceneImage image{text_of(member(**json, "name")), text_of(member(**json, "mimeType")), {}};
      const std::string uri = text_of(member(**json, "uri"));
      std::string failure;
      if (!uri.empty()) {
        auto bytes = read_uri(document_, uri, place, limits_.image_bytes);
        if (bytes) image.bytes = std::move(*bytes);
        if (!bytes) failure = bytes.error().message;
        if (image.name.empty() && !uri.starts_with("data:")) image.name = uri;
      } else {
        const auto bytes = bytes_of_view(document_, index_of(member(**json, "bufferView")), place);
        if (bytes && bytes->size() <= limits_.image_bytes) image.bytes.assign(bytes->begin(), bytes->end());
        if (bytes && bytes->size() > limits_.image_bytes) failure = "the pictures are too large";
        if (!bytes) failure = bytes.error().message;
      }
      if (failure.empty()) {
        limits_.image_bytes -= image.bytes.size();
        result = static_cast<int>(scene_.images.size());
        scene_.images.push_back(std::move(image));
      } else {
        remark(fmt::format("{}: {}", place, failure));
      }
    }
    images_[index] = result;
    return result;
  }

  /// Scene primitives of a mesh: indices into scene_.primitives.
  Result<std::vector<int>> read_mesh(int mesh) {
    const auto known = meshes_.find(mesh);
    if (known != meshes_.end()) return known->second;
    const auto json = entry_of(document_, "meshes", mesh, "/nodes");
    if (!json) return tl::unexpected<Error>(json.error());
    const Json& primitives = member(**json, "primitives");
    std::vector<int> result;
    for (std::size_t p = 0; primitives.is_array() && p < primitives.size(); ++p) {
      const std::string place = fmt::format("/meshes/{}/primitives/{}", mesh, p);
      Result<std::optional<ScenePrimitive>> primitive =
          read_primitive(document_, primitives[p], place, limits_.vertices - vertices_);
      if (!primitive) return tl::unexpected<Error>(std::move(primitive.error()));
      if (!*primitive) {
        remark(fmt::format("{}: left out, for it has no triangles or no POSITION", place));
        continue;
      }
      if (!member(primitives[p], "targets").is_null()) remark("morph targets are not applied");
      ScenePrimitive& good = **primitive;
      if (good.material >= static_cast<int>(scene_.materials.size())) {
        return malformed(place, fmt::format("there is no material {}", good.material));
      }
      good.mesh = mesh;
      good.index = static_cast<int>(p);
      const std::string name = text_of(member(**json, "name"));
      good.name = fmt::format("{}/{}", name.empty() ? fmt::format("mesh {}", mesh) : name, p);
      vertices_ += good.positions.size();
      indices_ += good.indices.size();
      if (indices_ / indices_per_vertex > limits_.vertices) {
        return fail(Code::file_too_large, document_.file, place, "too many triangles");
      }
      result.push_back(static_cast<int>(scene_.primitives.size()));
      scene_.primitives.push_back(std::move(good));
    }
    meshes_[mesh] = result;
    return result;
  }

  std::vector<int> roots() const {
    std::vector<int> result;
    const Json& scenes = member(document_.json, "scenes");
    const Json& nodes = member(document_.json, "nodes");
    if (scenes.is_array() && !scenes.empty()) {
      const int chosen = std::max(0, index_of(member(document_.json, "scene")));
      if (static_cast<std::size_t>(chosen) >= scenes.size()) return {-1};
      const Json& list = member(scenes[static_cast<std::size_t>(chosen)], "nodes");
      for (std::size_t i = 0; list.is_array() && i < list.size(); ++i) result.push_back(index_of(list[i]));
      return result;
    }
    std::set<int> children;
    for (std::size_t i = 0; nodes.is_array() && i < nodes.size(); ++i) {
      const Json& list = member(nodes[i], "children");
      for (std::size_t c = 0; list.is_array() && c < list.size(); ++c) children.insert(index_of(list[c]));
    }
    for (int i = 0; nodes.is_array() && i < static_cast<int>(nodes.size()); ++i) {
      if (!children.contains(i)) result.push_back(i);
    }
    return result;
  }

  Result<void> read_nodes() {
    std::vector<std::pair<int, M44d>> open;
    for (const int root : roots()) open.emplace_back(root, M44d());
    std::reverse(open.begin(), open.end());
    std::set<int> visited;
    while (!open.empty()) {
      const auto [index, parent] = open.back();
      open.pop_back();
      const std::string place = fmt::format("/nodes/{}", index);
      const auto node = entry_of(document_, "nodes", index, "/scenes");
      if (!node) return tl::unexpected<Error>(node.error());
      if (!visited.insert(index).second) return malformed(place, "the node is reached twice");
      const std::optional<M44d> local = local_transform(**node);
      if (!local) return malformed(place, "the transform is not made of the right number of numbers");
      const M44d world = *local * parent;
      if (const int mesh = index_of(member(**node, "mesh")); mesh >= 0) {
        const Result<std::vector<int>> primitives = read_mesh(mesh);
        if (!primitives) return tl::unexpected<Error>(primitives.error());
        for (const int primitive : *primitives) scene_.instances.push_back({primitive, world});
        if (!member(**node, "skin").is_null()) remark("skins are not applied: the mesh is shown as stored");
        if (scene_.instances.size() > limits_.instances) {
          return fail(Code::file_too_large, document_.file, place, "too many instances");
        }
      }
      const Json& children = member(**node, "children");
      for (std::size_t c = children.is_array() ? children.size() : 0; c-- > 0;) {
        open.emplace_back(index_of(children[c]), world);
      }
    }
    return {};
  }

  void remark_on_what_is_not_read() {
    if (!member(document_.json, "animations").is_null()) remark("animations are not played");
    for (const Json& name : member(document_.json, "extensionsUsed")) {
      if (name == "EXT_mesh_gpu_instancing") remark("EXT_mesh_gpu_instancing is not read");
      if (name == "KHR_materials_variants") remark("KHR_materials_variants: the default materials are used");
    }
  }

  const GltfDocument& document_;
  SceneLimits limits_;
  Scene scene_;
  static constexpr std::size_t indices_per_vertex = 6;  ///< of a closed mesh
  std::size_t vertices_ = 0;
  std::size_t indices_ = 0;
  std::map<int, int> images_;
  std::map<int, std::vector<int>> meshes_;
};

}  // namespace

Result<Scene> read_scene(const GltfDocument& document, const SceneLimits& limits) {
  return Reader(document, limits).read();
}

Result<Scene> read_scene(const std::string& path, const SceneLimits& limits) {
  const Result<GltfDocument> document = load_gltf(path);
  if (!document) return tl::unexpected<Error>(document.error());
  return read_scene(*document, limits);
}

}  // namespace selvedge
