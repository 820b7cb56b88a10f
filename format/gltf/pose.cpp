#include "format/gltf/pose.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "format/gltf/access.h"
#include "format/gltf/geometry.h"

namespace selvedge {
namespace {

V3f unit_or_zero(const V3d& v) {
  const double length = v.length();
  return std::isfinite(length) && length > 0 ? V3f(v / length) : V3f(0, 0, 0);
}

/// values += weight * the target's differences; a tangent's handedness is not morphed.
template <class Difference, class V>
Result<void> add_differences(const GltfDocument& document, const Json& target, const char* semantic,
                             double weight, const std::string& place, std::vector<V>& values) {
  const Json& accessor = member(target, semantic);
  if (accessor.is_null() || values.empty()) return {};
  const auto differences = read_vectors<Difference>(document, index_of(accessor), values.size(),
                                                    fmt::format("{}/{}", place, semantic));
  if (!differences) return tl::unexpected<Error>(differences.error());
  using Number = typename V::BaseType;
  for (std::size_t i = 0; i < values.size(); ++i) {
    for (int c = 0; c < static_cast<int>(Difference::dimensions()); ++c) {
      values[i][c] = static_cast<Number>(values[i][c] + weight * (*differences)[i][c]);
    }
  }
  return {};
}

Result<void> add_target(const GltfDocument& document, const Json& target, double weight,
                        const std::string& place, ScenePrimitive& vertices) {
  const auto add = [&]<class Difference>(Difference, const char* semantic, auto& values) {
    return add_differences<Difference>(document, target, semantic, weight, place, values);
  };
  const Json& color = member(target, "COLOR_0");
  const bool has_alpha = !color.is_null() &&
                         shape_of(document, index_of(color), place).value_or(AccessorShape{}).components == 4;
  for (Result<void> good :
       {add(V3d(), "POSITION", vertices.positions), add(V3d(), "NORMAL", vertices.normals),
        add(V3d(), "TANGENT", vertices.tangents), add(V2d(), "TEXCOORD_0", vertices.tex_coords[0]),
        add(V2d(), "TEXCOORD_1", vertices.tex_coords[1]),
        has_alpha ? add(V4f(), "COLOR_0", vertices.colors) : add(V3f(), "COLOR_0", vertices.colors)}) {
    if (!good) return good;
  }
  return {};
}

/// The matrix of every vertex: the mean of its joints by their weights.
Result<std::vector<M44d>> skin_matrices(const GltfDocument& document, const Json& primitive,
                                        const std::string& place, const std::vector<M44d>& joints,
                                        std::size_t vertices) {
  const M44d none(0.0);
  std::vector<M44d> matrices(vertices, none);
  std::vector<double> sums(vertices, 0);
  std::vector<std::size_t> first(vertices, 0);
  const Json& attributes = member(primitive, "attributes");
  for (int set = 0;; ++set) {
    const std::array names{fmt::format("JOINTS_{}", set), fmt::format("WEIGHTS_{}", set)};
    std::array<std::vector<Imath::V4d>, 2> read;
    const std::string where = fmt::format("{}/attributes/", place);
    for (std::size_t i = 0; i < 2; ++i) {
      const Json& accessor = member(attributes, names[i].c_str());
      if (accessor.is_null()) break;
      auto vectors = read_vectors<Imath::V4d>(document, index_of(accessor), vertices, where + names[i]);
      if (!vectors) return tl::unexpected<Error>(vectors.error());
      read[i] = std::move(*vectors);
    }
    const auto& [numbers, weights] = read;
    if (weights.empty()) break;
    for (std::size_t v = 0; v < vertices; ++v) {
      for (int k = 0; k < 4; ++k) {
        const double weight = weights[v][k];
        const double number = numbers[v][k];
        if (!(number >= 0 && number < static_cast<double>(joints.size()))) {
          return fail(Code::gltf_accessor, document.file, where + names[0],
                      fmt::format("vertex {} follows joint {} of {}", v, number, joints.size()));
        }
        const auto joint = static_cast<std::size_t>(number);
        if (set == 0 && k == 0) first[v] = joint;
        if (weight == 0) continue;
        matrices[v] += joints[joint] * weight;
        sums[v] += weight;
      }
    }
  }
  for (std::size_t v = 0; v < vertices; ++v) {
    if (sums[v] > 0) {
      matrices[v] *= 1 / sums[v];  // quantised weights do not add up to 1 exactly
    } else if (first[v] < joints.size()) {
      matrices[v] = joints[first[v]];
    }
  }
  return matrices;
}

void skin(const std::vector<M44d>& matrices, ScenePrimitive& vertices) {
  for (std::size_t v = 0; v < matrices.size(); ++v) {
    const M44d& m = matrices[v];
    V3d point;
    m.multVecMatrix(V3d(vertices.positions[v]), point);
    vertices.positions[v] = V3f(point);
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

NodeTransforms::NodeTransforms(const GltfDocument& document) : document_(document) {
  const Json& nodes = array_of(document.json, "nodes");
  parents_.assign(nodes.size(), -1);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    for (const Json& child : array_of(nodes[i], "children")) {
      const auto number = static_cast<std::size_t>(index_of(child));
      if (number < parents_.size()) parents_[number] = static_cast<int>(i);
    }
  }
}

Result<M44d> NodeTransforms::world(int node) const {
  M44d world;
  int steps = 0;
  for (int at = node; at >= 0; at = parents_[at]) {
    const std::string place = fmt::format("/nodes/{}", at);
    const auto json = entry_of(document_, "nodes", at, place);
    if (!json) return tl::unexpected<Error>(json.error());
    const std::optional<M44d> local = local_transform(**json);
    if (!local)
      return fail(Code::gltf_malformed, document_.file, place,
                  "the transform is not made of the right number of numbers");
    if (++steps > static_cast<int>(parents_.size()))
      return fail(Code::gltf_malformed, document_.file, place, "the node is its own ancestor");
    world = world * *local;
  }
  return world;
}

Result<Pose> pose_of(const GltfDocument& document, const Json& node, const Json& mesh,
                     const NodeTransforms& transforms, const std::string& place_of_node) {
  Pose pose;
  const Json& owner = member(node, "weights").is_array() ? node : mesh;
  for (const Json& weight : array_of(owner, "weights")) pose.weights.push_back(number_of(weight, 0));
  const Json& number = member(node, "skin");
  if (number.is_null()) return pose;
  const std::string place = fmt::format("/skins/{}", index_of(number));
  const auto skin_json = entry_of(document, "skins", index_of(number), place_of_node + "/skin");
  if (!skin_json) return tl::unexpected<Error>(skin_json.error());
  const Json& joints = array_of(**skin_json, "joints");
  const std::size_t count = joints.size();
  std::vector<double> inverse;
  if (const Json& accessor = member(**skin_json, "inverseBindMatrices"); !accessor.is_null()) {
    const std::string where = place + "/inverseBindMatrices";
    const Result<AccessorShape> shape = shape_of(document, index_of(accessor), where);
    if (!shape) return tl::unexpected<Error>(shape.error());
    auto numbers = read_numbers(document, index_of(accessor), where);
    if (!numbers) return tl::unexpected<Error>(std::move(numbers.error()));
    if (shape->components != 16 || shape->count < count)
      return fail(Code::gltf_malformed, document.file, where, "there is not one matrix per joint");
    inverse = std::move(*numbers);
  }
  std::vector<M44d> matrices;
  for (std::size_t j = 0; j < count; ++j) {
    const Result<M44d> world = transforms.world(index_of(joints[j]));
    if (!world) return tl::unexpected<Error>(world.error());
    M44d bind;
    // glTF's columns are Imath's rows.
    if (!inverse.empty()) std::copy_n(inverse.begin() + static_cast<std::ptrdiff_t>(16 * j), 16, &bind[0][0]);
    matrices.push_back(bind * *world);
  }
  pose.joints = std::move(matrices);
  return pose;
}

Result<void> apply_pose(const GltfDocument& document, const Json& primitive, const std::string& place,
                        const Pose& pose, ScenePrimitive& vertices) {
  const Json& targets = array_of(primitive, "targets");
  bool morphed = false;
  for (std::size_t t = 0; t < std::min(targets.size(), pose.weights.size()); ++t) {
    if (pose.weights[t] == 0) continue;
    morphed = true;
    if (Result<void> good = add_target(document, targets[t], pose.weights[t],
                                       fmt::format("{}/targets/{}", place, t), vertices);
        !good) {
      return good;
    }
  }
  if (morphed) {
    for (V3f& n : vertices.normals) n = unit_or_zero(V3d(n));
    for (V4f& t : vertices.tangents) {
      const V3f unit = unit_or_zero(V3d(t.x, t.y, t.z));
      t = V4f(unit.x, unit.y, unit.z, t.w);
    }
  }
  if (!pose.joints || pose.joints->empty()) return {};
  const auto matrices = skin_matrices(document, primitive, place, *pose.joints, vertices.positions.size());
  if (!matrices) return tl::unexpected<Error>(matrices.error());
  skin(*matrices, vertices);
  return {};
}

}  // namespace selvedge
