// The fibres at the surface of a yarn, as seeded noise at the points that rays meet: no geometry.
//
// The surface of a yarn or ply is covered with strands of fibres that lie side by side and follow the fibres'
// lay. Each strand is a little round, and over lengths of a few radii it differs in height, lean, direction
// and colour from its neighbours.
#pragma once

#include "converter/light/yarn_brdf.h"

namespace selvedge {

/// Turns the normal and the fibre of a surface to those of the strand that is met, and changes its albedo;
/// its mean over the yarn stays. The normal stays on the ray's side. Of a hair only the albedo changes, with
/// that of its yarn. Surfaces that lie on no yarn, and points that no ray met, stay as they are.
void add_fibre_noise(const CellMesh& mesh, const SurfacePoint& point, YarnSurface& surface);

}  // namespace selvedge
