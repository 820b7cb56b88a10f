// Whether light from outside reaches the backs of triangles.
#pragma once

#include "converter/light/ray_scene.h"

namespace selvedge {

/// Whether more than a few of the surfaces that diffuse light from above (and `from_below`) meets, or reaches
/// in up to `bounces` reflections, are backs, as with open sheets or random winding. Intersecting closed
/// yarns show a few backs as well.
bool shows_backs(const RayScene& scene, int bounces, bool from_below);

}  // namespace selvedge
