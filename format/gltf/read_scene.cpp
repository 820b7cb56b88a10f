#include "format/gltf/read_scene.h"

#include <Imath/ImathMatrix.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "format/gltf/access.h"
#include "format/gltf/geometry.h"
#include "format/gltf/materials.h"
#include "format/gltf/names.h"
#include "format/gltf/node_items.h"
#include "format/gltf/pose.h"

namespace selvedge {
namespace {

std::string text_of(const Json& value) {
  return value.is_string() ? value.get<std::string>() : std::string();
}

class Reader {
 public:
  Reader(const GltfDocument& document, const SceneLimits& limits, const SceneChoice& choice)
      : document_(document), limits_(limits), choice_(choice), transforms_(document) {
    limits_.vertices = std::min(limits_.vertices, unbacked_elements(document));
  }

  Result<Scene> read() {
    scene_.file = document_.file;
    for (Result<void> (Reader::*step)() : {&Reader::read_choice, &Reader::read_looks, &Reader::read_nodes}) {
      if (Result<void> good = (this->*step)(); !good) return tl::unexpected<Error>(std::move(good.error()));
    }
    remark_on_what_is_not_read();
    return std::move(scene_);
  }

 private:
  Result<void> read_looks() { return read_materials(document_, limits_.image_bytes, scene_); }

  tl::unexpected<Error> malformed(std::string place, std::string message) const {
    return fail(Code::gltf_malformed, document_.file, std::move(place), std::move(message));
  }

  tl::unexpected<Error> no_such(const char* option, const std::string& wanted, const Json& entries) const {
    std::string present;
    for (std::size_t i = 0; entries.is_array() && i < entries.size(); ++i) {
      present += fmt::format("{}{} \"{}\"", i == 0 ? "" : ", ", i, text_of(member(entries[i], "name")));
    }
    return fail(
        Code::option_out_of_range, document_.file, option,
        fmt::format("there is no \"{}\"; the file has {}", wanted, present.empty() ? "none" : present));
  }

  void remark(std::string text) { selvedge::remark(scene_, std::move(text)); }

  /// Scene primitives of a mesh in the pose of a node: indices into scene_.primitives. Nodes that show the
  /// same share them.
  Result<std::vector<int>> read_mesh(int mesh, const Json& node) {
    const auto json = entry_of(document_, "meshes", mesh, "/nodes");
    if (!json) return tl::unexpected<Error>(json.error());
    const auto [entry, fresh] = meshes_.try_emplace(
        fmt::format("{} {} {}", mesh, index_of(member(node, "skin")), member(node, "weights").dump()));
    if (!fresh) return entry->second;
    const Result<Pose> pose = pose_of(document_, node, **json, transforms_);
    if (!pose) return tl::unexpected<Error>(pose.error());
    const Json& primitives = member(**json, "primitives");
    for (std::size_t p = 0; primitives.is_array() && p < primitives.size(); ++p) {
      const std::string place = fmt::format("/meshes/{}/primitives/{}", mesh, p);
      Result<std::optional<ScenePrimitive>> primitive =
          read_primitive(document_, primitives[p], place, limits_.vertices - vertices_, *pose);
      if (!primitive) return tl::unexpected<Error>(std::move(primitive.error()));
      if (!*primitive) {
        remark(fmt::format("{}: left out, for it has no triangles or no POSITION", place));
        continue;
      }
      ScenePrimitive& good = **primitive;
      if (variant_ >= 0) good.material = material_of_variant(primitives[p], good.material);
      if (good.material >= static_cast<int>(scene_.materials.size())) {
        return malformed(place, fmt::format("there is no material {}", good.material));
      }
      good.mesh = mesh;
      good.index = static_cast<int>(p);
      const std::string name = text_of(member(**json, "name"));
      good.name = fmt::format("{}/{}", name.empty() ? fmt::format("mesh {}", mesh) : name, p);
      remark_on_coarse_coordinates(primitives[p], good);
      vertices_ += good.positions.size();
      indices_ += good.indices.size();
      if (indices_ / indices_per_vertex > limits_.vertices) {
        return fail(Code::file_too_large, document_.file, place, "too many triangles");
      }
      entry->second.push_back(static_cast<int>(scene_.primitives.size()));
      scene_.primitives.push_back(std::move(good));
    }
    return entry->second;
  }

  int material_of_variant(const Json& primitive, int otherwise) const {
    const Json& mappings = member(member(member(primitive, "extensions"), names::gltf::variants), "mappings");
    for (std::size_t i = 0; mappings.is_array() && i < mappings.size(); ++i) {
      const Json& variants = member(mappings[i], "variants");
      const bool meant =
          variants.is_array() && std::any_of(variants.begin(), variants.end(),
                                             [&](const Json& v) { return index_of(v) == variant_; });
      if (meant) return index_of(member(mappings[i], "material"));
    }
    return otherwise;
  }

  /// Far from zero the file's own floats are too far apart for a fabric's texels: nothing can bring them
  /// back.
  void remark_on_coarse_coordinates(const Json& json, const ScenePrimitive& primitive) {
    if (primitive.material < 0) return;
    const SceneMaterial& material = scene_.materials[primitive.material];
    if (!material.fabric || material.fabric->tex_coord > 1) return;
    const std::string semantic = fmt::format("TEXCOORD_{}", material.fabric->tex_coord);
    const auto shape =
        shape_of(document_, index_of(member(member(json, "attributes"), semantic.c_str())), "");
    if (!shape || shape->component_type != 5126) return;
    V2d largest(0, 0);
    for (const V2d& uv : primitive.tex_coords[material.fabric->tex_coord]) {
      largest = V2d(std::max(largest.x, std::abs(uv.x)), std::max(largest.y, std::abs(uv.y)));
    }
    constexpr double finest = 1.0 / 1024;  // of a repeat: a quarter of a texel of a large fabric
    const auto step_at = [](double value) {
      return std::nextafter(static_cast<float>(value), std::numeric_limits<float>::infinity()) -
             static_cast<float>(value);
    };
    const double step =
        std::max(material.fabric->transform.apply_linear(V2d(double{step_at(largest.x)}, 0)).length(),
                 material.fabric->transform.apply_linear(V2d(0, double{step_at(largest.y)})).length());
    if (step <= finest) return;
    remark(fmt::format("{}: its {} reach {:.4g}, where floats are {:.2g} repeats of the fabric apart",
                       primitive.name, semantic, std::max(largest.x, largest.y), step));
  }

  std::vector<int> roots() const {
    std::vector<int> result;
    const Json& scenes = member(document_.json, "scenes");
    const Json& nodes = member(document_.json, "nodes");
    if (scenes.is_array() && !scenes.empty()) {
      const int chosen =
          scene_index_ >= 0 ? scene_index_ : std::max(0, index_of(member(document_.json, "scene")));
      if (static_cast<std::size_t>(chosen) >= scenes.size()) return {-1};
      const Json& list = member(scenes[chosen], "nodes");
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
      if (Result<void> good = read_mesh_of_node(**node, place, world); !good) return good;
      if (auto camera = camera_of_node(document_, **node, world, scene_)) scene_.cameras.push_back(*camera);
      if (auto light = light_of_node(document_, **node, world, scene_)) scene_.lights.push_back(*light);
      const Json& children = member(**node, "children");
      for (std::size_t c = children.is_array() ? children.size() : 0; c-- > 0;) {
        open.emplace_back(index_of(children[c]), world);
      }
    }
    return {};
  }

  Result<void> read_mesh_of_node(const Json& node, const std::string& place, const M44d& world) {
    const int mesh = index_of(member(node, "mesh"));
    if (mesh < 0) return {};
    const Result<std::vector<int>> primitives = read_mesh(mesh, node);
    if (!primitives) return tl::unexpected<Error>(primitives.error());
    // A skin's joints say where its vertices are, the node does not (glTF 2.0, section 3.7.3.3).
    const bool skinned = !member(node, "skin").is_null();
    const auto places = places_of_node(document_, node, place, skinned ? M44d() : world, limits_.instances);
    if (!places) return tl::unexpected<Error>(places.error());
    for (const M44d& at : *places) {
      for (const int primitive : *primitives) scene_.instances.push_back({primitive, at});
    }
    if (scene_.instances.size() > limits_.instances) {
      return fail(Code::file_too_large, document_.file, place, "too many instances");
    }
    return {};
  }

  /// An entry of `entries` by its name, else by its number; -1 where `wanted` is empty.
  Result<int> choose(const char* option, const std::string& wanted, const Json& entries) const {
    if (wanted.empty()) return -1;
    const std::size_t count = entries.is_array() ? entries.size() : 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (member(entries[i], "name") == wanted) return static_cast<int>(i);
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (std::to_string(i) == wanted) return static_cast<int>(i);
    }
    return no_such(option, wanted, entries);
  }

  Result<void> read_choice() {
    const Result<int> scene = choose("--scene", choice_.scene, member(document_.json, "scenes"));
    if (!scene) return tl::unexpected<Error>(scene.error());
    scene_index_ = *scene;
    const Json& extension = member(member(document_.json, "extensions"), names::gltf::variants);
    const Result<int> variant = choose("--variant", choice_.variant, member(extension, "variants"));
    if (!variant) return tl::unexpected<Error>(variant.error());
    variant_ = *variant;
    return {};
  }

  void remark_on_what_is_not_read() {
    if (!member(document_.json, "animations").is_null()) remark("animations are not played");
    for (const Json& name : member(document_.json, "extensionsUsed")) {
      if (name == names::gltf::variants && variant_ < 0)
        remark("KHR_materials_variants: the default materials are used");
    }
  }

  const GltfDocument& document_;
  SceneLimits limits_;
  const SceneChoice& choice_;
  NodeTransforms transforms_;
  int scene_index_ = -1;
  int variant_ = -1;
  Scene scene_;
  static constexpr std::size_t indices_per_vertex = 6;  ///< of a closed mesh
  std::size_t vertices_ = 0;
  std::size_t indices_ = 0;
  std::map<std::string, std::vector<int>> meshes_;  ///< by mesh, skin and weights
};

}  // namespace

Result<Scene> read_scene(const GltfDocument& document, const SceneLimits& limits, const SceneChoice& choice) {
  return Reader(document, limits, choice).read();
}

Result<Scene> read_scene(const std::string& path, const SceneLimits& limits, const SceneChoice& choice) {
  const Result<GltfDocument> document = load_gltf(path);
  if (!document) return tl::unexpected<Error>(document.error());
  return read_scene(*document, limits, choice);
}

}  // namespace selvedge
