#include <fmt/format.h>

#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <vector>

#include "format/check/gltf_parts.h"
#include "format/gltf/access.h"
#include "format/gltf/geometry.h"

namespace selvedge {
namespace {

/// Quaternions may be rounded to 8 bits: half a step in each of four components.
constexpr double unit_tolerance = 0.0079;
/// Cosine of the angle between a matrix' axes that is taken for rounding.
constexpr double skew_tolerance = 1e-3;

bool is_index(const Json& array, int index) {
  return array.is_array() && index >= 0 && static_cast<std::size_t>(index) < array.size();
}

/// Numbers of an array of `count`, or nothing.
std::optional<std::vector<double>> numbers_of(const Json& json, std::size_t count) {
  if (!json.is_array() || json.size() != count) return std::nullopt;
  std::vector<double> numbers;
  for (const Json& value : json) {
    if (!value.is_number()) return std::nullopt;
    numbers.push_back(value.get<double>());
  }
  return numbers;
}

class NodeCheck {
 public:
  NodeCheck(const GltfDocument& document, IssueSink& issues)
      : document_(document), root_(document.json), issues_(issues), nodes_(member(root_, "nodes")) {}

  void check() {
    parents_.assign(nodes_.is_array() ? nodes_.size() : 0, -1);
    for_each_object(root_, "nodes", [&](const Json& node, int index) { check_node(node, index); });
    check_loops();
    for_each_object(root_, "scenes", [&](const Json& scene, int index) { check_scene(scene, index); });
    for_each_object(root_, "cameras", [&](const Json& camera, int index) { check_camera(camera, index); });
    for_each_object(root_, "skins", [&](const Json& skin, int index) { check_skin(skin, index); });
    for_each_object(root_, "animations", [&](const Json& animation, int index) {
      check_animation(animation, fmt::format("/animations/{}", index));
    });
  }

 private:
  void wrong(const std::string& place, std::string message) {
    issues_.add(Code::gltf_malformed, place, std::move(message));
  }

  void check_node(const Json& node, int index) {
    const std::string place = fmt::format("/nodes/{}", index);
    const Json& children = member(node, "children");
    for (std::size_t c = 0; children.is_array() && c < children.size(); ++c) {
      const int child = index_of(children[c]);
      if (!is_index(nodes_, child)) continue;
      int& parent = parents_[child];
      if (parent >= 0 && parent != index) {
        wrong(fmt::format("{}/children/{}", place, c), fmt::format("node {} has two parents", child));
      }
      parent = index;
    }
    const bool has_matrix = node.contains("matrix");
    if (has_matrix && (node.contains("translation") || node.contains("rotation") || node.contains("scale"))) {
      wrong(place + "/matrix", "stands beside translation, rotation or scale");
    }
    if (const auto matrix = numbers_of(member(node, "matrix"), 16)) check_matrix(*matrix, place + "/matrix");
    if (const auto q = numbers_of(member(node, "rotation"), 4)) {
      const double length =
          std::sqrt((*q)[0] * (*q)[0] + (*q)[1] * (*q)[1] + (*q)[2] * (*q)[2] + (*q)[3] * (*q)[3]);
      if (!(std::abs(length - 1) <= unit_tolerance)) {
        wrong(place + "/rotation", fmt::format("the quaternion's length is {}", length));
      }
    }
    check_mesh(node, place);
  }

  /// Of a node with its mesh: skin and weights.
  void check_mesh(const Json& node, const std::string& place) {
    const Json& meshes = member(root_, "meshes");
    const int mesh = index_of(member(node, "mesh"));
    for (const char* name : {"skin", "weights"}) {
      if (node.contains(name) && !node.contains("mesh")) {
        wrong(fmt::format("{}/{}", place, name), "stands without mesh");
      }
    }
    if (!is_index(meshes, mesh)) return;
    const Json& primitives = member(meshes[mesh], "primitives");
    if (!primitives.is_array() || primitives.empty()) return;
    const Json& targets = member(primitives[0], "targets");
    const std::size_t count = targets.is_array() ? targets.size() : 0;
    const Json& weights = member(node, "weights");
    if (weights.is_array() && weights.size() != count) {
      wrong(place + "/weights", fmt::format("{} weights for {} targets", weights.size(), count));
    }
    if (!node.contains("skin")) return;
    for (std::size_t p = 0; p < primitives.size(); ++p) {
      if (!member(member(primitives[p], "attributes"), "JOINTS_0").is_null()) continue;
      wrong(place + "/skin", fmt::format("primitive {} of mesh {} has no joints", p, mesh));
      return;
    }
  }

  /// Decomposable into translation, rotation and scale: affine, its axes perpendicular.
  void check_matrix(const std::vector<double>& m, const std::string& place) {
    bool good = m[3] == 0 && m[7] == 0 && m[11] == 0 && m[15] == 1;
    for (std::size_t a = 0; a < 3; ++a) {
      const std::size_t b = (a + 1) % 3;
      double dot = 0;
      double square_a = 0;
      double square_b = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        dot += m[a * 4 + k] * m[b * 4 + k];
        square_a += m[a * 4 + k] * m[a * 4 + k];
        square_b += m[b * 4 + k] * m[b * 4 + k];
      }
      good = good && std::abs(dot) <= skew_tolerance * std::sqrt(square_a * square_b);
    }
    if (!good) wrong(place, "is no product of translation, rotation and scale");
  }

  void check_loops() {
    // Follows each node to its root once; a node met again on the same way is on a loop.
    std::vector<int> way(parents_.size(), -1);
    for (int start = 0; start < static_cast<int>(parents_.size()); ++start) {
      int node = start;
      while (node >= 0 && way[node] < 0) {
        way[node] = start;
        node = parents_[node];
      }
      if (node >= 0 && way[node] == start) {
        wrong(fmt::format("/nodes/{}", node), "the node is its own ancestor");
      }
    }
  }

  void check_scene(const Json& scene, int index) {
    const Json& list = member(scene, "nodes");
    for (std::size_t i = 0; list.is_array() && i < list.size(); ++i) {
      const int node = index_of(list[i]);
      if (is_index(nodes_, node) && parents_[node] >= 0) {
        wrong(fmt::format("/scenes/{}/nodes/{}", index, i), fmt::format("node {} has a parent", node));
      }
    }
  }

  void check_camera(const Json& camera, int index) {
    const std::string place = fmt::format("/cameras/{}", index);
    const bool perspective = camera.contains("perspective");
    if (perspective == camera.contains("orthographic")) {
      wrong(place, "needs either perspective or orthographic");
    }
    const Json& lens = member(camera, perspective ? "perspective" : "orthographic");
    const double far = number_of(member(lens, "zfar"), HUGE_VAL);
    if (far <= number_of(member(lens, "znear"), 0)) wrong(place, "zfar is not greater than znear");
    for (const char* name : {"xmag", "ymag"}) {
      if (!perspective && number_of(member(lens, name), 1) == 0)
        wrong(place + "/orthographic/" + name, "is 0");
    }
  }

  void check_skin(const Json& skin, int index) {
    const Json& accessor = member(skin, "inverseBindMatrices");
    const Json& joints = member(skin, "joints");
    if (accessor.is_null()) return;
    const std::string place = fmt::format("/skins/{}/inverseBindMatrices", index);
    const auto shape = shape_of(document_, index_of(accessor), place);
    if (!shape) return;
    if (shape->components != 16 || shape->component_type != 5126) {
      wrong(place, "inverse bind matrices are MAT4 of floats");
    }
    if (joints.is_array() && shape->count < joints.size()) {
      wrong(place, fmt::format("{} matrices for {} joints", shape->count, joints.size()));
    }
  }

  struct Track {
    std::string_view path;
    int components;
    bool integers;  ///< normalised integers do as well as floats
  };

  void check_animation(const Json& animation, const std::string& place) {
    const Json& samplers = member(animation, "samplers");
    for_each_object(animation, "samplers", [&](const Json& sampler, int s) {
      check_times(member(sampler, "input"), member(sampler, "interpolation") == "CUBICSPLINE",
                  fmt::format("{}/samplers/{}/input", place, s));
    });
    std::set<std::pair<int, std::string>> targets;
    for_each_object(animation, "channels", [&](const Json& channel, int c) {
      const std::string where = fmt::format("{}/channels/{}", place, c);
      const int sampler = index_of(member(channel, "sampler"));
      const Json& target = member(channel, "target");
      const int node = index_of(member(target, "node"));
      const Json& path = member(target, "path");
      if (sampler >= 0 && !is_index(samplers, sampler)) {
        issues_.add(Code::gltf_accessor, where + "/sampler", fmt::format("there is no sampler {}", sampler));
      }
      if (!path.is_string()) return;
      if (node >= 0 && !targets.insert({node, path.get<std::string>()}).second) {
        wrong(where + "/target", "is the target of another channel, too");
      }
      if (is_index(samplers, sampler)) {
        check_track(samplers[sampler], path.get<std::string>(), node, where);
      }
    });
  }

  void check_times(const Json& accessor, bool cubic, const std::string& place) {
    const auto shape = shape_of(document_, index_of(accessor), place);
    if (!shape) return;
    const Json& json = root_["accessors"][index_of(accessor)];
    if (shape->components != 1 || shape->component_type != 5126) wrong(place, "times are SCALAR floats");
    if (!json.contains("min") || !json.contains("max")) wrong(place, "accessors of times need min and max");
    if (cubic && shape->count < 2) wrong(place, "a cubic spline needs two times");
  }

  void check_track(const Json& sampler, const std::string& path, int node, const std::string& place) {
    constexpr std::array<Track, 4> tracks{
        {{"translation", 3, false}, {"rotation", 4, true}, {"scale", 3, false}, {"weights", 1, true}}};
    std::size_t targets = 1;
    if (is_index(nodes_, node)) {
      const Json& json = nodes_[node];
      if (path == "weights") {
        targets = targets_of(index_of(member(json, "mesh")));
        if (targets == 0) wrong(place + "/target", "the node has no morph targets");
      } else if (json.contains("matrix") && path != "pointer") {
        wrong(place + "/target", "the node has a matrix");
      }
    }
    const auto input = shape_of(document_, index_of(member(sampler, "input")), "");
    const auto output = shape_of(document_, index_of(member(sampler, "output")), "");
    if (!input || !output) return;
    for (const Track& track : tracks) {
      if (track.path != path) continue;
      const bool floats = output->component_type == 5126;
      const bool integers = track.integers && output->normalized;
      if (output->components != track.components || !(floats || integers)) {
        wrong(place + "/sampler", fmt::format("the output is of a wrong format for {}", path));
      }
    }
    const std::size_t each = member(sampler, "interpolation") == "CUBICSPLINE" ? 3 : 1;
    if (path != "pointer" && targets > 0 && output->count != input->count * each * targets) {
      wrong(place + "/sampler", fmt::format("{} outputs for {} times", output->count, input->count));
    }
  }

  std::size_t targets_of(int mesh) const {
    const Json& meshes = member(root_, "meshes");
    if (!is_index(meshes, mesh)) return 0;
    const Json& primitives = member(meshes[mesh], "primitives");
    if (!primitives.is_array() || primitives.empty()) return 0;
    const Json& targets = member(primitives[0], "targets");
    return targets.is_array() ? targets.size() : 0;
  }

  const GltfDocument& document_;
  const Json& root_;
  IssueSink& issues_;
  const Json& nodes_;
  std::vector<int> parents_;
};

}  // namespace

void check_nodes(const GltfDocument& document, IssueSink& issues) { NodeCheck(document, issues).check(); }

}  // namespace selvedge
