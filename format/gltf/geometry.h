// Reading the triangles of a glTF primitive, and a node's transform.
#pragma once

#include <optional>
#include <string>

#include "format/gltf/access.h"
#include "format/gltf/pose.h"
#include "format/scene/scene.h"

namespace selvedge {

/// The vertices and triangles of a primitive; nothing for points and lines, or without POSITION. `place` is
/// its JSON pointer, `vertex_limit` the highest number of vertices. The caller sets the name and checks the
/// material. A pose morphs and skins the vertices before missing normals become flat ones. FILE_TOO_LARGE
/// beyond the limit; other faults come from the accessors.
std::optional<ScenePrimitive> read_primitive(GltfReader& reader, const Json& primitive,
                                             const std::string& place, std::size_t vertex_limit,
                                             const Pose& pose = {});

/// Replaces normals of length 0 by means of the triangles around them; all of them by flat ones, if all are
/// 0, as without normals. Returns whether there were any.
bool replace_invalid_normals(ScenePrimitive& primitive);

/// Vertex numbers of the triangles of a primitive with `vertices` vertices, three each: strips and fans are
/// expanded, a missing index list counts up, every index is checked, and an incomplete triangle left out.
/// GLTF_MALFORMED for points and lines.
std::vector<std::uint32_t> read_triangles(GltfReader& reader, const Json& primitive, const std::string& place,
                                          std::size_t vertices);

/// A node's matrix, or its translation, rotation and scale; nothing if an array is of the wrong size. Row
/// vectors: glTF's column-major numbers are Imath's rows.
std::optional<M44d> local_transform(const Json& node);
/// Whether KHR_node_visibility lets a node be seen. Hidden nodes hide the meshes and lights below them, too.
bool is_visible(const Json& node);
inline constexpr const char* malformed_transform = "the transform is not made of the right number of numbers";

}  // namespace selvedge
