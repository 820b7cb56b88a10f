// The camera and the light of a glTF node, and the copies of its mesh.
#pragma once

#include <vector>

#include "format/gltf/access.h"
#include "format/scene/scene.h"

namespace selvedge {

/// Adds the node's camera to the scene, if it has one. A camera without a usable lens is left out with a
/// remark.
void read_camera(const GltfDocument& document, const Json& node, const M44d& world, Scene& scene);

/// Adds the node's light (KHR_lights_punctual), if it has one. A light with numbers out of range is left out
/// with a remark.
void read_light(const GltfDocument& document, const Json& node, const M44d& world, Scene& scene);

/// The transforms with which a node's mesh is drawn: `world`, or with EXT_mesh_gpu_instancing one for each
/// element of its attributes. GLTF_MALFORMED for attributes of different lengths; FILE_TOO_LARGE beyond
/// `limit`.
std::vector<M44d> places_of_node(GltfReader& reader, const Json& node, const std::string& place,
                                 const M44d& world, std::size_t limit);

}  // namespace selvedge
