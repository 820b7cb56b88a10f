// An inner surface for solid things, so that nobody looks through the holes of their cloth to the far side.
#pragma once

#include <set>

#include "converter/dress/uv_scale.h"
#include "format/base/vec.h"
#include "format/gltf/document.h"
#include "format/gltf/materials.h"

namespace selvedge {

struct Backing {
  V3f color{0, 0, 0};   ///< linear
  double distance = 0;  ///< metres behind the cloth
};

/// Adds to the meshes of the places copies of their primitives in a plain matt material, moved against the
/// triangles' normals, which are means where vertices lie in one point, so that nothing gapes at a seam. They
/// share all vertex data but the positions with the cloth, move with its skins and morph targets, are drawn
/// from outside alone, and have no variants. A metre is found by the area that `in_scene`, of the same
/// document, has for the places. Returns their number; throws
/// Failure.
int add_backing(GltfDocument& document, int material, const std::set<PrimitiveIndex>& places,
                const PrimitivesInScene& in_scene, const Backing& backing);

}  // namespace selvedge
