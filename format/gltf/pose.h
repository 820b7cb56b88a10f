// Morph targets and skins at rest: the positions of a primitive's vertices while no animation plays.
#pragma once

#include <string>
#include <vector>

#include "format/gltf/access.h"
#include "format/scene/scene.h"

namespace selvedge {

/// The weights and joints that move the vertices of a mesh on a node.
struct Pose {
  std::vector<double> weights;  ///< of the morph targets; a missing weight counts as 0
  std::vector<M44d> joints;     ///< of the skin: mesh -> world, row vectors; empty without a skin
};

/// The transforms of all nodes, in scenes or not.
class NodeTransforms {
 public:
  explicit NodeTransforms(const GltfDocument& document);
  /// Steps of all calls together. A chain of nodes that are joints has the square of its length.
  static constexpr std::size_t max_steps = std::size_t{1} << 21;
  /// Node -> world. GLTF_MALFORMED for nodes that are their own ancestors and for malformed transforms,
  /// FILE_TOO_LARGE beyond max_steps.
  M44d world(GltfReader& reader, int node);
  /// Counts steps of other work with joints.
  void take_steps(GltfReader& reader, std::size_t steps, const std::string& place);
  bool has_parent(int node) const { return parents_[node] >= 0; }

 private:
  std::vector<int> parents_;  ///< -1: a root
  std::size_t steps_ = 0;
};

/// The pose of the mesh on a node: the node's weights or the mesh's own, and the node's skin. `place` is the
/// node's JSON pointer.
Pose pose_of(GltfReader& reader, const Json& node, const Json& mesh, NodeTransforms& transforms,
             const std::string& place);

/// Morphs, then skins, positions, normals and tangents (texture coordinates and colours are morphed only) of
/// a primitive as read. Normals and tangents are unit afterwards. A vertex without weights follows the first
/// of its joints. GLTF_ACCESSOR for joints that are not in the skin.
void apply_pose(GltfReader& reader, const Json& primitive, const std::string& place, const Pose& pose,
                ScenePrimitive& vertices);

}  // namespace selvedge
