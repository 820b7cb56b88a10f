// What a glTF node carries besides its mesh: a camera, a light, copies of its mesh.
#pragma once

#include <optional>
#include <vector>

#include "format/base/error.h"
#include "format/gltf/document.h"
#include "format/scene/scene.h"

namespace selvedge {

/// The node's camera; nothing where it has none, or one that says too little to look through (remarked).
std::optional<SceneCamera> camera_of_node(const GltfDocument& document, const Json& node, const M44d& world,
                                          Scene& scene);

/// The node's light (KHR_lights_punctual), likewise.
std::optional<SceneLight> light_of_node(const GltfDocument& document, const Json& node, const M44d& world,
                                        Scene& scene);

/// Where a node's mesh is drawn: `world`, or with EXT_mesh_gpu_instancing as many times as its attributes
/// say. GLTF_MALFORMED for attributes that do not fit together; FILE_TOO_LARGE beyond `limit`.
Result<std::vector<M44d>> places_of_node(const GltfDocument& document, const Json& node,
                                         const std::string& place, const M44d& world, std::size_t limit);

}  // namespace selvedge
