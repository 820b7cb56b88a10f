// Refinement of a control cage, through OpenMesh.
#pragma once

#include "samples/surface.h"

namespace selvedge::samples {

/// Catmull-Clark subdivision, `levels` times (0: a copy). Every quad becomes four that keep its label;
/// boundaries become smooth curves of their own. The vertices of the cage stay the first ones, in order.
/// Precondition: the cage is a two-manifold.
QuadSurface subdivide(const QuadSurface& cage, int levels);

}  // namespace selvedge::samples
