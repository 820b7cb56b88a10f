// How large the primitives of a document are in its scene, and which way they hang.
#pragma once

#include <map>

#include "format/gltf/material_uses.h"
#include "format/scene/scene.h"

namespace selvedge {

struct PlaceInScene {
  double area = 0;     ///< twice that of the first instance, m^2, as it rests
  V3d down{0, -1, 0};  ///< the direction of the mesh's frame that grows towards the ground, of any length
};

using PlacesInScene = std::map<Place, PlaceInScene>;

PlacesInScene places_in(const Scene& scene);

/// Twice the area of the triangles, in the unit of the positions.
double area_of(const std::vector<V3d>& positions, const std::vector<std::uint32_t>& triangles);

}  // namespace selvedge
