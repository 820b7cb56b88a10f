// Morph targets and skins at rest: where a glTF primitive's vertices are while no animation plays.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "format/gltf/document.h"
#include "format/scene/scene.h"

namespace selvedge {

/// What moves the vertices of a mesh on a node.
struct Pose {
  std::vector<double> weights;              ///< of the morph targets; what is missing counts as 0
  std::optional<std::vector<M44d>> joints;  ///< of the skin: mesh -> world, row vectors
};

/// The transforms of nodes, wherever in the file they stand.
class NodeTransforms {
 public:
  explicit NodeTransforms(const GltfDocument& document);
  /// Node -> world. GLTF_MALFORMED for nodes that are their own ancestors and transforms that are none.
  Result<M44d> world(int node) const;
  bool has_parent(int node) const { return parents_[node] >= 0; }

 private:
  const GltfDocument& document_;
  std::vector<int> parents_;  ///< -1: none
};

/// The pose of the mesh on a node: the node's weights or the mesh's own, and the node's skin. `place` is the
/// node's JSON pointer.
Result<Pose> pose_of(const GltfDocument& document, const Json& node, const Json& mesh,
                     const NodeTransforms& transforms, const std::string& place);

/// Morphs, then skins, positions, normals and tangents (texture coordinates and colours are morphed only) of
/// a primitive as read. Normals and tangents are unit afterwards. A vertex without weights follows the first
/// of its joints. GLTF_ACCESSOR for joints that are not there.
Result<void> apply_pose(const GltfDocument& document, const Json& primitive, const std::string& place,
                        const Pose& pose, ScenePrimitive& vertices);

}  // namespace selvedge
