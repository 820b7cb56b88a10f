// One glTF primitive -> triangles, and a node's transform.
#pragma once

#include <optional>
#include <string>

#include "format/gltf/document.h"
#include "format/gltf/pose.h"
#include "format/scene/scene.h"

namespace selvedge {

/// The vertices and triangles of a primitive; nothing for points and lines, or without POSITION. `place` is
/// its JSON pointer, `vertex_limit` what it may have. Material and name are the caller's to check and to set.
/// With a pose morphed and skinned, before normals that are missing become flat ones.
Result<std::optional<ScenePrimitive>> read_primitive(const GltfDocument& document, const Json& primitive,
                                                     const std::string& place, std::size_t vertex_limit,
                                                     const Pose& pose = {});

/// Vertex numbers of the triangles of a primitive with `vertices` vertices, three each: strips and fans are
/// expanded, a missing index list counted up, every index checked, and an incomplete triangle left out.
/// GLTF_MALFORMED for points and lines.
Result<std::vector<std::uint32_t>> read_triangles(const GltfDocument& document, const Json& primitive,
                                                  const std::string& place, std::size_t vertices);

/// A node's matrix, or its translation, rotation and scale; nothing if an array is of the wrong size. Row
/// vectors: glTF's column-major numbers are Imath's rows.
std::optional<M44d> local_transform(const Json& node);

}  // namespace selvedge
