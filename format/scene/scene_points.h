// Where a scene's triangles are in the world.
#pragma once

#include <vector>

#include "format/base/error.h"
#include "format/scene/scene.h"

namespace selvedge {

/// Positions of all vertices that triangles use, in world coordinates (m). GARMENT_EMPTY where there are
/// none, MESH_NOT_FINITE, MESH_INVALID.
Result<std::vector<V3d>> world_points(const Scene& scene);

}  // namespace selvedge
