// A level floor under a scene, which takes the shadow of a sky without a sun: soft, and darkest where they
// touch.
#pragma once

#include <vector>

#include "format/picture/frame.h"
#include "format/scene/camera.h"
#include "viewer/scene/mesh.h"

namespace selvedge {

/// Fraction of the light that a scene hides from places of a floor, on a square grid: 0.6 of the fraction of
/// an even sky, as walls and lamps light the rest. Coordinates are the mesh's, in metres, y up.
struct Floor {
  static constexpr int grid_size = 96;  ///< cells
  double height = 0;                    ///< y: the lowest point of the scene
  V2d centre{0, 0};                     ///< x and z
  double width = 1;                     ///< of the grid, metres
  std::vector<float> hidden_fraction;   ///< [z][x], at the cells' middles; 0 at the border

  /// Between the cells; 0 beyond them.
  float hidden_fraction_at(double x, double z) const;
};

/// A cell of the scene's lower side, at the height h over the floor, hides h^2 / (pi (r^2 + h^2)^2) of an
/// even sky, by its area, from a place at the distance r beside it (the form factor of parallel patches).
Floor find_floor(const MergedSurfaces& mesh);

/// Composites the frame over a floor as black as its shade; the scene's origin is the mesh's. Seen from
/// above.
void add_floor(const Floor& floor, const Camera& camera, const V3d& origin, Frame& frame);

}  // namespace selvedge
