// Adds the TANGENT attribute to primitives of a glTF document.
#pragma once

#include "format/gltf/document.h"

namespace selvedge {

/// Adds tangents of the UV set `tex_coord` (0 or 1), which the primitive must have; true if something was
/// added, false if the primitive has TANGENT already or is not made of triangles. Where charts of opposite
/// handedness meet, vertices are duplicated in every attribute and morph target; a primitive without normals
/// gets flat normals, as glTF prescribes, and separate vertices for each triangle. Accessors that other
/// primitives may share are not changed. Throws Failure.
bool add_tangents(GltfDocument& document, int mesh, int primitive, int tex_coord);

/// Removes TANGENT from a primitive and its morph targets; the accessors stay in the file.
void drop_tangents(Json& primitive);

}  // namespace selvedge
