// The surfaces that the sample garments are shaped from: quads with a panel label each.
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

}  // namespace selvedge::samples
