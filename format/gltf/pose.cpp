#include "format/gltf/pose.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "format/gltf/geometry.h"

namespace selvedge {
namespace {

V3f unit_or_zero(const V3d& v) {
  const double length = v.length();
  return std::isfinite(length) && length > 0 ? V3f(v / length) : V3f(0, 0, 0);
}

/// values += weight * the target's differences; a tangent's handedness is not morphed.
template <class Difference, class V>
void add_differences(GltfReader& reader, const Json& target, const char* semantic, double weight,
                     const std::string& place, std::vector<V>& values) {
  if (values.empty()) return;
  const auto differences = reader.attribute<Difference>(target, semantic, values.size(), place);
  for (std::size_t i = 0; i < differences.size(); ++i)
    for (int c = 0; c < static_cast<int>(Difference::dimensions()); ++c)
      values[i][c] = static_cast<typename V::BaseType>(values[i][c] + weight * differences[i][c]);
}

void add_target(GltfReader& reader, const Json& target, double weight, const std::string& place,
                ScenePrimitive& vertices) {
  const auto add = [&]<class Difference>(Difference, const char* semantic, auto& values) {
    add_differences<Difference>(reader, target, semantic, weight, place, values);
  };
  add(V3d(), "POSITION", vertices.positions);
  add(V3d(), "NORMAL", vertices.normals);
  add(V3d(), "TANGENT", vertices.tangents);
  add(V2d(), "TEXCOORD_0", vertices.tex_coords[0]);
  add(V2d(), "TEXCOORD_1", vertices.tex_coords[1]);
  const Json& color = root_entry(reader.document, "accessors", index_of(member(target, "COLOR_0")));
  if (component_count(color) == 4) return add(V4f(), "COLOR_0", vertices.colors);
  add(V3f(), "COLOR_0", vertices.colors);
}

/// The matrix of every vertex: the mean of its joints by their weights.
std::vector<M44d> skin_matrices(GltfReader& reader, const Json& primitive, const std::string& place,
                                const std::vector<M44d>& joints, std::size_t vertices) {
  std::vector<M44d> matrices(vertices, M44d(0.0));
  std::vector<double> sums(vertices, 0);
  std::vector<std::size_t> first(vertices, 0);
  const Json& attributes = member(primitive, "attributes");
  const std::string where = place + "/attributes";
  for (int set = 0;; ++set) {
    const std::string name = fmt::format("JOINTS_{}", set);
    const auto numbers = reader.attribute<Imath::V4d>(attributes, name.c_str(), vertices, where);
    if (numbers.empty()) break;
    const auto weights =
        reader.attribute<Imath::V4d>(attributes, fmt::format("WEIGHTS_{}", set).c_str(), vertices, where);
    if (weights.empty()) break;
    for (std::size_t v = 0; v < vertices; ++v) {
      for (int k = 0; k < 4; ++k) {
        const double weight = weights[v][k];
        const double number = numbers[v][k];
        if (!(number >= 0 && number < static_cast<double>(joints.size())))
          reader.fail(Code::gltf_accessor, where + "/" + name,
                      fmt::format("vertex {} follows joint {} of {}", v, number, joints.size()));
        const auto joint = static_cast<std::size_t>(number);
        if (set == 0 && k == 0) first[v] = joint;
        if (weight == 0) continue;
        matrices[v] += joints[joint] * weight;
        sums[v] += weight;
      }
    }
  }
  for (std::size_t v = 0; v < vertices; ++v)
    if (sums[v] > 0)
      matrices[v] *= 1 / sums[v];  // quantised weights do not add up to 1 exactly
    else if (first[v] < joints.size())
      matrices[v] = joints[first[v]];
  return matrices;
}

void skin(const std::vector<M44d>& matrices, ScenePrimitive& vertices) {
  for (std::size_t v = 0; v < matrices.size(); ++v) {
    const M44d& m = matrices[v];
    vertices.positions[v] = V3f(V3d(vertices.positions[v]) * m);
    const V3d x(m[0][0], m[0][1], m[0][2]);
    const V3d y(m[1][0], m[1][1], m[1][2]);
    const V3d z(m[2][0], m[2][1], m[2][2]);
    if (!vertices.normals.empty()) {
      // The cofactor matrix: the inverse transpose up to a factor, and defined for flat scales, too.
      const double sign = x.dot(y.cross(z)) < 0 ? -1 : 1;
      const V3f& n = vertices.normals[v];
      vertices.normals[v] = unit_or_zero((y.cross(z) * n.x + z.cross(x) * n.y + x.cross(y) * n.z) * sign);
    }
    if (!vertices.tangents.empty()) {
      V4f& t = vertices.tangents[v];
      const V3f moved = unit_or_zero(x * t.x + y * t.y + z * t.z);
      t = V4f(moved.x, moved.y, moved.z, t.w);
    }
  }
}

}  // namespace

NodeTransforms::NodeTransforms(const GltfDocument& document) {
  const Json& nodes = array_member(document.json, "nodes");
  parents_.assign(nodes.size(), -1);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    for (const Json& child : array_member(nodes[i], "children")) {
      const auto number = static_cast<std::size_t>(index_of(child));
      if (number < parents_.size()) parents_[number] = static_cast<int>(i);
    }
  }
}

void NodeTransforms::take_steps(GltfReader& reader, std::size_t steps, const std::string& place) {
  steps_ += std::min(steps, max_steps + 1);
  if (steps_ > max_steps)
    reader.fail(Code::file_too_large, place,
                fmt::format("joints, their ancestors and matrices are more than {}", max_steps));
}

M44d NodeTransforms::world(GltfReader& reader, int node) {
  M44d world;
  int steps = 0;
  for (int at = node; at >= 0; at = parents_[at]) {
    const std::string place = fmt::format("/nodes/{}", at);
    take_steps(reader, 1, place);
    const std::optional<M44d> local = local_transform(reader.entry("nodes", at, place));
    if (!local) reader.fail(Code::gltf_malformed, place, malformed_transform);
    if (++steps > static_cast<int>(parents_.size()))
      reader.fail(Code::gltf_malformed, place, "the node is its own ancestor");
    world = world * *local;
  }
  return world;
}

Pose pose_of(GltfReader& reader, const Json& node, const Json& mesh, NodeTransforms& transforms,
             const std::string& place_of_node) {
  Pose pose;
  const Json& owner = member(node, "weights").is_array() ? node : mesh;
  for (const Json& weight : array_member(owner, "weights")) pose.weights.push_back(number_or(weight, 0));
  const Json& number = member(node, "skin");
  if (number.is_null()) return pose;
  const std::string place = fmt::format("/skins/{}", index_of(number));
  const Json& skin = reader.entry("skins", index_of(number), place_of_node + "/skin");
  const Json& joints = array_member(skin, "joints");
  if (joints.empty()) reader.fail(Code::gltf_malformed, place, "the skin has no joints");
  std::vector<double> inverse;
  if (const Json& accessor = member(skin, "inverseBindMatrices"); !accessor.is_null()) {
    const std::string where = place + "/inverseBindMatrices";
    const AccessorShape shape = reader.accessor_shape(index_of(accessor), where);
    transforms.take_steps(reader, shape.count, where);
    inverse = reader.numbers(index_of(accessor), where);
    if (shape.components != 16 || shape.count < joints.size())
      reader.fail(Code::gltf_malformed, where, "there is not one matrix per joint");
  }
  for (std::size_t j = 0; j < joints.size(); ++j) {
    M44d bind;
    // glTF's columns are Imath's rows.
    if (!inverse.empty()) std::copy_n(inverse.begin() + static_cast<std::ptrdiff_t>(16 * j), 16, &bind[0][0]);
    pose.joints.push_back(bind * transforms.world(reader, index_of(joints[j])));
  }
  return pose;
}

void apply_pose(GltfReader& reader, const Json& primitive, const std::string& place, const Pose& pose,
                ScenePrimitive& vertices) {
  const Json& targets = array_member(primitive, "targets");
  bool morphed = false;
  for (std::size_t t = 0; t < std::min(targets.size(), pose.weights.size()); ++t) {
    if (pose.weights[t] == 0) continue;
    morphed = true;
    add_target(reader, targets[t], pose.weights[t], fmt::format("{}/targets/{}", place, t), vertices);
  }
  if (morphed) {
    for (V3f& n : vertices.normals) n = unit_or_zero(V3d(n));
    for (V4f& t : vertices.tangents) {
      const V3f unit = unit_or_zero(V3d(t.x, t.y, t.z));
      t = V4f(unit.x, unit.y, unit.z, t.w);
    }
  }
  if (pose.joints.empty()) return;
  skin(skin_matrices(reader, primitive, place, pose.joints, vertices.positions.size()), vertices);
}

}  // namespace selvedge
