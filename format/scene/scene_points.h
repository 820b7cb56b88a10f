// Positions of a scene's vertices in the world.
#pragma once

#include <vector>

#include "format/base/error.h"
#include "format/scene/scene.h"

namespace selvedge {

/// World positions (m) of all vertices that triangles use. GARMENT_EMPTY without triangles, MESH_NOT_FINITE,
/// MESH_INVALID.
Result<std::vector<V3d>> world_points(const Scene& scene);

}  // namespace selvedge
