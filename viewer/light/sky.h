// The fraction of light from all around that reaches the vertices of a scene: folds, sleeves and the inside
// of a collar keep light from each other.
#pragma once

#include <vector>

#include "format/fabric/smooth_light.h"
#include "viewer/light/shadow_maps.h"

namespace selvedge {

/// Fractions of the light from directions over the sphere that reach the vertices, on the side of the cloth
/// that faces the direction.
struct SkyVisibility {
  std::vector<V3f> directions;
  std::vector<std::uint8_t> fractions;  ///< [vertex][direction], of 255
};

/// Draws shadow maps towards the directions. `occluders`: of `mesh`.
SkyVisibility sky_visibility(const MergedSurfaces& mesh, const Occluders& occluders);

/// Smooth light as each vertex sees it; exact where nothing hides it.
std::vector<SmoothLight> light_at_vertices(const SkyVisibility& visibility, const SmoothLight& light);

}  // namespace selvedge
