// Refinement of a control cage, through OpenMesh.
#pragma once

#include <array>
#include <vector>

#include "format/base/vec.h"

namespace selvedge::samples {

using Quad = std::array<int, 4>;

/// A two-manifold of quads with boundary; metres. Quads are counter-clockwise seen from outside.
struct QuadSurface {
  std::vector<V3d> positions;
  std::vector<Quad> quads;
  std::vector<int> labels;  ///< one per quad: the panel of the garment
};

/// Catmull-Clark subdivision, `levels` times (0: a copy). Every quad becomes four that keep its label;
/// boundaries become smooth curves of their own. The vertices of the cage stay the first ones, in order.
/// Precondition: the cage is a two-manifold.
QuadSurface subdivide(const QuadSurface& cage, int levels);

}  // namespace selvedge::samples
