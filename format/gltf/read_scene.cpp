#include "format/gltf/read_scene.h"

#include <Imath/ImathMatrix.h>
#include <Imath/ImathQuat.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include "format/base/guard.h"
#include "format/gltf/access.h"
#include "format/gltf/clip.h"
#include "format/gltf/geometry.h"
#include "format/gltf/materials.h"
#include "format/gltf/memory.h"
#include "format/gltf/names.h"
#include "format/gltf/pose.h"

namespace selvedge {
namespace {

std::string name_of(const Json& json, const Json& node) {
  const std::string name = string_of(member(json, "name"));
  return name.empty() ? string_of(member(node, "name")) : name;
}

V3d row(const M44d& m, int i) { return {m[i][0], m[i][1], m[i][2]}; }

bool finite(const M44d& m) {
  return std::all_of(&m[0][0], &m[0][0] + 16, [](double x) { return std::isfinite(x); });
}

bool is_positive(double value) { return std::isfinite(value) && value > 0; }

/// Adds the node's camera to the scene, if it has one. A camera without a usable lens is left out with a
/// remark.
void read_camera(const GltfDocument& document, const Json& node, const M44d& world, Scene& scene) {
  const int index = index_of(member(node, "camera"));
  if (index < 0) return;
  const Json& json = root_entry(document, "cameras", index);
  SceneCamera camera;
  camera.world = world;
  camera.name = name_of(json, node);
  camera.is_perspective = member(json, "type") != "orthographic";
  const Json& lens = member(json, camera.is_perspective ? "perspective" : "orthographic");
  const auto number = [&](const char* key) { return number_or(member(lens, key), 0); };
  camera.znear = number("znear");
  camera.yfov = number("yfov");
  camera.half_size = V2d(number("xmag"), number("ymag"));
  if (const double far = number("zfar"); far > camera.znear) camera.zfar = far;
  if (const double aspect = number("aspectRatio"); is_positive(aspect)) camera.aspect = aspect;
  const bool has_lens =
      camera.is_perspective
          ? is_positive(camera.yfov) && camera.yfov < std::numbers::pi && camera.znear > 0
          : is_positive(camera.half_size.x) && is_positive(camera.half_size.y) && camera.zfar.has_value();
  if (has_lens && finite(world) && row(world, 2).length() > 0) return scene.cameras.push_back(camera);
  add_remark(scene, fmt::format("/cameras/{}: nothing can be seen through it; left out", index));
}

/// Adds the node's light (KHR_lights_punctual), if it has one. A light with numbers out of range is left out
/// with a remark.
void read_light(const GltfDocument& document, const Json& node, const M44d& world, Scene& scene) {
  using names::gltf::lights_punctual;
  const Json& number = member(member(member(node, "extensions"), lights_punctual), "light");
  if (number.is_null()) return;
  const int index = index_of(number);
  const Json& lights = array_member(member(member(document.json, "extensions"), lights_punctual), "lights");
  const std::string place = fmt::format("/extensions/{}/lights/{}", lights_punctual, index);
  const auto leave_out = [&](const char* why) {
    add_remark(scene, fmt::format("{}: {}; left out", place, why));
  };
  if (static_cast<std::size_t>(index) >= lights.size()) return leave_out("there is no such light");
  const Json& json = lights[index];
  SceneLight light{.name = name_of(json, node)};
  const Json& type = member(json, "type");
  if (type == "point")
    light.kind = LightKind::point;
  else if (type == "spot")
    light.kind = LightKind::spot;
  else if (type != "directional")
    return leave_out("unknown type");
  const Json& color = member(json, "color");
  for (std::size_t c = 0; color.is_array() && c < 3 && c < color.size(); ++c)
    light.color[static_cast<int>(c)] = static_cast<float>(number_or(color[c], 1));
  light.intensity = static_cast<float>(number_or(member(json, "intensity"), 1));
  light.range = number_or(member(json, "range"), 0);
  light.position = V3d(world[3][0], world[3][1], world[3][2]);
  // The extension ignores scales.
  light.direction = -row(world, 2).normalized();
  if (light.kind == LightKind::spot) {
    const Json& spot = member(json, "spot");
    light.inner_cone = number_or(member(spot, "innerConeAngle"), 0);
    light.outer_cone = number_or(member(spot, "outerConeAngle"), std::numbers::pi / 4);
    if (!(light.inner_cone >= 0 && light.inner_cone < light.outer_cone &&
          light.outer_cone <= std::numbers::pi / 2))
      return leave_out("the angles of its cone are out of range");
  }
  if (!finite(world) || light.direction.length() < 0.5) return leave_out("its node has no direction");
  if (!(light.intensity >= 0) || !std::isfinite(light.intensity) || !(light.range >= 0))
    return leave_out("its intensity or range is out of range");
  scene.lights.push_back(light);
}

/// The transforms with which a node's mesh is drawn: `world`, or with EXT_mesh_gpu_instancing one for each
/// element of its attributes. GLTF_MALFORMED for attributes of different lengths; FILE_TOO_LARGE beyond
/// `limit`.
std::vector<M44d> places_of_node(GltfReader& reader, const Json& node, const std::string& place,
                                 const M44d& world, std::size_t limit) {
  using names::gltf::gpu_instancing;
  const Json& extension = member(member(node, "extensions"), gpu_instancing);
  if (extension.is_null()) return {world};
  const std::string where = fmt::format("{}/extensions/{}/attributes", place, gpu_instancing);
  const Json& attributes = member(extension, "attributes");
  std::size_t count = 0;  // of the first attribute, and so of all
  const auto read = [&]<class V>(V, const char* name) {
    const Json& accessor = member(attributes, name);
    const std::string at = where + "/" + name;
    if (!accessor.is_null() && reader.accessor_shape(index_of(accessor), at).count > limit)
      reader.fail(Code::file_too_large, at, "too many instances");
    std::vector<V> values = reader.attribute<V>(attributes, name, count, where);
    if (!values.empty()) count = values.size();
    return values;
  };
  const auto translations = read(V3d(), "TRANSLATION");
  const auto rotations = read(Imath::V4d(), "ROTATION");
  const auto scales = read(V3d(), "SCALE");
  std::vector<M44d> places;
  for (std::size_t i = 0; i < count; ++i) {
    M44d local;
    if (!scales.empty()) local.setScale(scales[i]);
    if (!rotations.empty()) {
      const Imath::V4d& r = rotations[i];
      local *= Imath::Quatd(r.w, r.x, r.y, r.z).normalized().toMatrix44();
    }
    if (!translations.empty()) local *= M44d().setTranslation(translations[i]);
    places.push_back(local * world);
  }
  return places;
}

/// Reading stops after this number of broken primitives.
constexpr int max_failures = 100;
/// Vertices that morph targets and sets of joints move, each time counted, of all primitives together.
constexpr std::uint64_t max_moved_vertices = std::uint64_t{1} << 26;

class SceneReader {
 public:
  /// `everything`: reads all nodes, and continues after an error.
  SceneReader(const GltfDocument& document, const SceneLimits& limits, bool everything, IssueSink& issues)
      : document_(document), limits_(limits), everything_(everything), issues_(issues) {
    limits_.vertices = std::min(limits_.vertices, max_unbacked_elements(document));
  }

  Scene read(const SceneChoice& choice) {
    scene_.file = document_.file;
    const int scene = choose("--scene", choice.scene, array_member(document_.json, "scenes"));
    const Json& extension = member(member(document_.json, "extensions"), names::gltf::variants);
    variant_ = choose("--variant", choice.variant, array_member(extension, "variants"));
    if (issues_.has_error()) return {};
    for (const Json& variant : array_member(extension, "variants"))
      scene_.variants.push_back(string_of(member(variant, "name")));
    for (const std::string& text : document_.remarks) add_remark(scene_, text);
    if (member(document_.json, "extensions").contains("VRM")) scene_.front_azimuth = 180;
    read_materials(document_, limits_.image_bytes, memory_.unspent_bytes(), scene_, issues_);
    std::uint64_t held = 0;
    for (const SceneImage& image : scene_.images) held += image.bytes.size();
    for (const SceneFabric& fabric : scene_.fabrics) held += fabric.bytes.size();
    if (!memory_.try_spend(held, 1)) {
      add(memory_limit_error(document_.file, "", "its pictures and fabrics", limits_.document.memory));
      return {};
    }
    read_nodes(roots(scene));
    if (!member(document_.json, "animations").is_null()) add_remark(scene_, "animations are not played");
    for (const Json& name : array_member(document_.json, "extensionsUsed"))
      if (name == names::gltf::variants && variant_ < 0)
        add_remark(scene_, "KHR_materials_variants: the default materials are used");
    scene_.memory_left = memory_.unspent_bytes();
    return std::move(scene_);
  }

 private:
  /// Whether reading stops here.
  bool is_done() const { return exhausted_ || (!everything_ && issues_.has_error()); }

  void add(Error error) {
    exhausted_ = exhausted_ || error.code == Code::file_too_large;
    // Primitives that share an accessor find the same fault.
    if (reported_.emplace(error.code, error.place).second) issues_.add(std::move(error));
  }

  void add(Code code, std::string place, std::string message) {
    add(Error{code, document_.file, std::move(place), std::move(message)});
  }

  /// Whether the work was done: a Failure is added to the issues.
  template <class F>
  bool attempt(const F& work) {
    const auto done = catch_failure(work);
    if (!done) add(done.error());
    return done.has_value();
  }

  /// The primitives of a mesh in the pose of a node, as indices into scene_.primitives. Nodes with the same
  /// mesh, skin and weights share them.
  std::vector<int> read_mesh(int mesh, const Json& node, const std::string& place) {
    GltfReader reader(document_);
    const Json& json = reader.entry("meshes", mesh, place + "/mesh");
    shown_.insert(mesh);
    const auto [entry, fresh] = meshes_.try_emplace(
        fmt::format("{} {} {}", mesh, index_of(member(node, "skin")), member(node, "weights").dump()));
    if (!fresh) return entry->second;
    const Pose pose = pose_of(reader, node, json, transforms_, place);
    const Json& primitives = array_member(json, "primitives");
    for (std::size_t p = 0; p < primitives.size() && !is_done(); ++p) {
      std::optional<ScenePrimitive> primitive;
      // Each by itself, so that the faults of all are found.
      if (!attempt([&] { primitive = read_primitive(json, mesh, static_cast<int>(p), pose); }))
        exhausted_ = exhausted_ || ++failures_ == max_failures;
      if (!primitive) continue;
      entry->second.push_back(static_cast<int>(scene_.primitives.size()));
      scene_.primitives.push_back(std::move(*primitive));
    }
    return entry->second;
  }

  /// Nothing for a primitive without triangles, which is remarked.
  std::optional<ScenePrimitive> read_primitive(const Json& mesh_json, int mesh, int index, const Pose& pose) {
    const Json& json = mesh_json["primitives"][index];
    const std::string place = fmt::format("/meshes/{}/primitives/{}", mesh, index);
    if (!has_room(json))
      throw Failure{memory_limit_error(document_.file, place, "its vertices", limits_.document.memory)};
    GltfReader reader(document_);
    const Json& attributes = member(json, "attributes");
    std::size_t moves = std::ranges::count_if(pose.weights, [](double weight) { return weight != 0; });
    for (const auto& [name, accessor] : attributes.items()) moves += name.starts_with("JOINTS_") ? 1 : 0;
    if (!moved_vertices_.try_spend(moves, declared_count(member(attributes, "POSITION"))))
      reader.fail(Code::file_too_large, place,
                  fmt::format("morph targets and joints move more than {} vertices", max_moved_vertices));
    auto read = selvedge::read_primitive(reader, json, place, limits_.vertices - vertices_, pose);
    if (!read) {
      add_remark(scene_, fmt::format("{}: left out, for it has no triangles or no POSITION", place));
      return std::nullopt;
    }
    const std::size_t given = read->positions.size();
    if (replace_invalid_normals(*read)) {
      // Flat normals make a vertex of every corner.
      if (read->positions.size() > limits_.vertices - vertices_ ||
          !memory_.try_spend(read->positions.size() - given, bytes_per_vertex))
        throw Failure{memory_limit_error(document_.file, place, "its vertices", limits_.document.memory)};
      const std::string normals = "has normals of length 0, which are made from the triangles around them";
      issues_.add(Code::gltf_advice, place + "/attributes/NORMAL", normals);
      add_remark(scene_, fmt::format("{}/attributes/NORMAL {}", place, normals));
    }
    vertices_ += read->positions.size();
    indices_ += read->indices.size();
    if (indices_ / indices_per_vertex > limits_.vertices)
      reader.fail(Code::file_too_large, place, "too many triangles");
    for (int variant = 0; variant < static_cast<int>(scene_.variants.size()); ++variant)
      read->variant_materials.push_back(material_of_variant(json, variant, read->material));
    if (variant_ >= 0) read->material = read->variant_materials[variant_];
    if (read->material >= static_cast<int>(scene_.materials.size()))
      reader.fail(Code::gltf_accessor, place + "/material",
                  fmt::format("there is no material {}", read->material));
    const std::string name = string_of(member(mesh_json, "name"));
    read->name = fmt::format("{}/{}", name.empty() ? fmt::format("mesh {}", mesh) : name, index);
    read->mesh = mesh;
    read->primitive_index = index;
    return read;
  }

  /// Elements of an accessor, as it declares itself. Faults are found where it is read, such as more elements
  /// than the view has.
  std::size_t declared_count(const Json& accessor) const {
    const auto count = catch_failure([&] {
      GltfReader reader(document_);
      const int index = index_of(accessor);
      const AccessorShape shape = reader.accessor_shape(index, "");
      const int view = index_of(member(root_entry(document_, "accessors", index), "bufferView"));
      if (view < 0) return shape.count;
      return std::min(shape.count, reader.view_bytes(view, "").size() / shape.element_size() + 1);
    });
    return count.value_or(0);
  }

  /// Whether the primitive, as it declares itself, fits into the memory; it is then taken.
  bool has_room(const Json& primitive) {
    const Json& attributes = member(primitive, "attributes");
    const std::size_t vertices = declared_count(member(attributes, "POSITION"));
    const Json& list = member(primitive, "indices");
    const std::size_t listed = list.is_null() ? vertices : declared_count(list);
    const bool triangles = index_of(member(primitive, "mode")) == 4 || member(primitive, "mode").is_null();
    const std::uint64_t indices = std::uint64_t{listed} * (triangles ? 1 : 3);
    // Flat normals make a vertex of every corner.
    const bool flat = member(attributes, "NORMAL").is_null();
    return memory_.try_spend(flat ? std::max<std::uint64_t>(vertices, indices) : vertices,
                             bytes_per_vertex) &&
           memory_.try_spend(indices, bytes_per_index);
  }

  /// The same of primitives with this number of instances.
  bool has_room(const std::vector<int>& primitives, std::size_t places) {
    std::uint64_t vertices = 0;
    std::uint64_t triangles = 0;
    for (const int primitive : primitives) {
      vertices += scene_.primitives[primitive].positions.size();
      triangles += scene_.primitives[primitive].indices.size() / 3;
    }
    return memory_.try_spend(places * primitives.size(), bytes_per_instance) &&
           memory_.try_spend(places, vertices * bytes_per_placed_vertex) &&
           memory_.try_spend(places, triangles * bytes_per_placed_triangle);
  }

  static const Json& mappings_of(const Json& primitive) {
    return array_member(member(member(primitive, "extensions"), names::gltf::variants), "mappings");
  }

  static int material_of_variant(const Json& primitive, int variant, int otherwise) {
    for (const Json& mapping : mappings_of(primitive)) {
      const Json& variants = array_member(mapping, "variants");
      const bool meant = std::ranges::any_of(variants, [&](const Json& v) { return index_of(v) == variant; });
      if (meant) return index_of(member(mapping, "material"));
    }
    return otherwise;
  }

  /// Whether a node of the scene, or one below it, has a mesh. Nodes in `visited` have none.
  bool shows_mesh(int scene, std::set<int>& visited) const {
    std::vector<int> open;
    const auto add = [&](const Json& nodes) {
      for (const Json& node : nodes) open.push_back(index_of(node));
    };
    add(array_member(root_entry(document_, "scenes", scene), "nodes"));
    while (!open.empty()) {
      const Json& node = root_entry(document_, "nodes", open.back());
      const bool is_new = visited.insert(open.back()).second;
      open.pop_back();
      if (!member(node, "mesh").is_null()) return true;
      if (is_new) add(array_member(node, "children"));
    }
    return false;
  }

  /// The default scene; if it is empty, the first scene with a mesh, with a remark.
  int default_scene() {
    const int stated = std::max(0, index_of(member(document_.json, "scene")));
    std::set<int> visited;
    if (root_entry(document_, "scenes", stated).is_null() || shows_mesh(stated, visited)) return stated;
    const Json& scenes = array_member(document_.json, "scenes");
    for (int i = 0; i < static_cast<int>(scenes.size()); ++i) {
      if (!shows_mesh(i, visited)) continue;
      add_remark(scene_, fmt::format("scene {}, the default one, shows no mesh: scene {} \"{}\" is read",
                                     stated, i, string_of(member(scenes[i], "name"))));
      return i;
    }
    return stated;
  }

  /// The nodes of the chosen scene, else of the default one. Without scenes, and if everything is read, all
  /// nodes without a parent.
  std::vector<int> roots(int scene) {
    std::vector<int> result;
    const Json& scenes = array_member(document_.json, "scenes");
    if (!scenes.empty()) {
      if (scene < 0) scene = default_scene();
      const Json& chosen = root_entry(document_, "scenes", scene);
      if (chosen.is_null()) result.push_back(-1);  // not a node
      for (const Json& node : array_member(chosen, "nodes")) result.push_back(index_of(node));
      if (!everything_) return result;
    }
    const std::set<int> listed(result.begin(), result.end());
    for (int i = 0; i < static_cast<int>(array_member(document_.json, "nodes").size()); ++i)
      if (!transforms_.has_parent(i) && !listed.contains(i)) result.push_back(i);
    return result;
  }

  void read_nodes(const std::vector<int>& roots) {
    struct Open {
      int index;
      M44d parent;
      bool visible;
    };
    std::vector<Open> open;
    for (const int root : roots) open.push_back({root, M44d(), true});
    std::ranges::reverse(open);
    std::set<int> visited;
    while (!open.empty() && !is_done()) {
      auto [index, parent, visible] = open.back();
      open.pop_back();
      const std::string place = fmt::format("/nodes/{}", index);
      const Json& node = root_entry(document_, "nodes", index);
      const std::optional<M44d> local = local_transform(node);
      const bool is_new = visited.insert(index).second;
      if (node.is_null())
        add(Code::gltf_accessor, "/scenes", fmt::format("there is no /nodes/{}", index));
      else if (!is_new || !local)
        add(Code::gltf_malformed, place, is_new ? malformed_transform : "the node is reached twice");
      if (node.is_null() || !is_new || !local) continue;
      const M44d world = *local * parent;
      visible = visible && is_visible(node);
      if (!visible) add_remark(scene_, "nodes that KHR_node_visibility hides are left out");
      if (visible) attempt([&] { read_mesh_of_node(node, place, world); });
      read_camera(document_, node, world, scene_);
      if (visible) read_light(document_, node, world, scene_);
      const Json& children = array_member(node, "children");
      for (std::size_t c = children.size(); c-- > 0;) open.push_back({index_of(children[c]), world, visible});
    }
    if (!everything_ || exhausted_) return;
    // Meshes and nodes that no scene shows.
    for (int i = 0; i < static_cast<int>(array_member(document_.json, "nodes").size()); ++i)
      if (!visited.contains(i))
        add(Code::gltf_malformed, fmt::format("/nodes/{}", i), "the node is its own ancestor");
    for (int m = 0; m < static_cast<int>(array_member(document_.json, "meshes").size()); ++m)
      if (!shown_.contains(m)) attempt([&] { read_mesh(m, Json::object(), ""); });
  }

  void read_mesh_of_node(const Json& node, const std::string& place, const M44d& world) {
    const int mesh = index_of(member(node, "mesh"));
    if (mesh < 0) return;
    const std::vector<int> primitives = read_mesh(mesh, node, place);
    // A skin's joints place its vertices, its node does not (glTF 2.0, section 3.7.3.3).
    const bool skinned = !member(node, "skin").is_null();
    GltfReader reader(document_);
    const auto places = places_of_node(reader, node, place, skinned ? M44d() : world, limits_.instances);
    if (places.size() * primitives.size() > limits_.instances - scene_.instances.size())
      reader.fail(Code::file_too_large, place, "too many instances");
    if (!has_room(primitives, places.size()))
      throw Failure{memory_limit_error(document_.file, place, "its instances", limits_.document.memory)};
    for (const M44d& at : places)
      for (const int primitive : primitives) scene_.instances.push_back({primitive, at});
  }

  /// find_entry(); -1 if `wanted` is empty or there is no such entry.
  int choose(const char* option, const std::string& wanted, const Json& entries) {
    if (wanted.empty()) return -1;
    const Result<int> found = find_entry(document_, option, wanted, entries);
    if (!found) add(found.error());
    return found.value_or(-1);
  }

  const GltfDocument& document_;
  SceneLimits limits_;
  MemoryBudget memory_{limits_.document.memory - std::min(limits_.document.memory, document_.memory_used)};
  MemoryBudget moved_vertices_{max_moved_vertices};
  bool everything_;
  IssueSink& issues_;
  NodeTransforms transforms_{document_};
  int variant_ = -1;
  Scene scene_;
  static constexpr std::size_t indices_per_vertex = 6;  ///< of a closed mesh
  std::size_t vertices_ = 0;
  std::size_t indices_ = 0;
  std::set<int> shown_;  ///< meshes
  int failures_ = 0;
  std::set<std::pair<Code, std::string>> reported_;
  bool exhausted_ = false;                          ///< a limit has been reached
  std::map<std::string, std::vector<int>> meshes_;  ///< by mesh, skin and weights
};

}  // namespace

Result<Scene> read_scene(const GltfDocument& document, const SceneLimits& limits, const SceneChoice& choice) {
  IssueSink issues(document.file);
  Scene scene = SceneReader(document, limits, false, issues).read(choice);
  if (issues.has_error()) return tl::unexpected<Error>(issues.first_error());
  return scene;
}

Scene read_whole_document(const GltfDocument& document, const SceneLimits& limits, IssueSink& issues) {
  return SceneReader(document, limits, true, issues).read({});
}

Result<Scene> read_scene(const std::string& path, const SceneLimits& limits, const SceneChoice& choice) {
  const Result<GltfDocument> document = load_gltf(path, limits.document);
  if (!document) return tl::unexpected<Error>(document.error());
  return read_scene(*document, limits, choice);
}

}  // namespace selvedge
