// Ribbed bands: hem, collar and cuffs, knitted on to the edge of a garment.
#pragma once

#include <string>
#include <vector>

#include "samples/assembly.h"
#include "samples/surface.h"

namespace selvedge::samples {

/// A closed strip of a surface as rings of points: ring 0 is the seam, the last one the open edge. All rings
/// have the same number of points, one behind the other, counter-clockwise seen from outside when the edge is
/// below the seam, i.e. the quad of ring i, i + 1 and column j, j + 1 is (i, j), (i + 1, j), (i + 1, j + 1),
/// (i, j + 1).
using Rings = std::vector<std::vector<int>>;

/// The quads with the label, peeled from the open boundary inwards. `first` picks the column that comes
/// first, by the largest value over the seam's points. Precondition: they are a closed strip, and a grid.
Rings peel(const QuadSurface& surface, int label, const V3d& first);

struct BandOptions {
  double rib = 0.010;        ///< metres of yarn length around, per rib: two wales of 5 mm
  double depth = 0.0009;     ///< metres from the mean surface to a rib's crest
  double roll = 0.0024;      ///< radius of the turned edge
  double turned_back = 0.4;  ///< how much of the height is turned to the inside
  int samples = 6;           ///< columns per rib
  double row = 0.010;        ///< height of a row, metres
  double middle_u = 0;       ///< where the chart lies
};

/// Replaces a strip of `surface` by a ribbed band with a turned edge, knit in one with the points of the
/// seam. New points are added to the assembly, which begins with the points of the surface.
void add_band(Assembly& assembly, const Rings& rings, const std::string& material,
              const BandOptions& options);

}  // namespace selvedge::samples
