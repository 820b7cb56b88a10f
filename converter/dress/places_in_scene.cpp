#include "converter/dress/places_in_scene.h"

namespace selvedge {

double area_of(const std::vector<V3d>& positions, const std::vector<std::uint32_t>& triangles) {
  double sum = 0;
  for (std::size_t t = 0; t + 2 < triangles.size(); t += 3) {
    const V3d& origin = positions[triangles[t]];
    sum += (positions[triangles[t + 1]] - origin).cross(positions[triangles[t + 2]] - origin).length();
  }
  return sum;
}

PlacesInScene places_in(const Scene& scene) {
  PlacesInScene places;
  for (const SceneInstance& instance : scene.instances) {
    const ScenePrimitive& p = scene.primitives[instance.primitive];
    const auto [entry, fresh] = places.try_emplace(Place(p.mesh, p.index));
    if (!fresh) continue;
    const M44d& world = instance.world;
    std::vector<V3d> positions;
    for (const V3f& position : p.positions) positions.push_back(V3d(position) * world);
    entry->second = {area_of(positions, p.indices), -V3d(world[0][1], world[1][1], world[2][1])};
  }
  return places;
}

}  // namespace selvedge
