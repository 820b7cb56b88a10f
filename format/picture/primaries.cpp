#include "format/picture/primaries.h"

#include <cmath>

#include "format/base/vec.h"

namespace selvedge {
namespace {

M33d scaling(const V3d& s) { return {s.x, 0, 0, 0, s.y, 0, 0, 0, s.z}; }

V3d white_of(const Primaries& p) { return {p[6] / p[7], 1, (1 - p[6] - p[7]) / p[7]}; }

/// XYZ of red, green and blue, one a row.
M33d xyz_of(const Primaries& p) {
  M33d rows;
  for (int k = 0; k < 3; ++k) {
    rows[k][0] = p[2 * k];
    rows[k][1] = p[2 * k + 1];
    rows[k][2] = 1 - p[2 * k] - p[2 * k + 1];
  }
  return scaling(white_of(p) * rows.inverse()) * rows;
}

}  // namespace

M33d shown_colours(const Primaries& primaries) {
  constexpr double equal = 2e-3;  // headers round to three digits
  const bool of_radiance =
      std::abs(primaries[6] - 1.0 / 3) < equal && std::abs(primaries[7] - 1.0 / 3) < equal;
  const Primaries& shown = of_radiance ? radiance_primaries : rec709_primaries;
  bool same = true;
  for (int k = 0; k < 8; ++k) same = same && std::abs(primaries[k] - shown[k]) < equal;
  const V2d red(primaries[0], primaries[1]);
  const V2d green(primaries[2], primaries[3]);
  const V2d blue(primaries[4], primaries[5]);
  const double area = (green - red).cross(blue - red);
  if (same || !(std::abs(area) > 1e-3 && std::abs(area) < 10 && primaries[7] > 1e-3)) return {};
  // Lindbloom's table of Bradford's cone responses, transposed.
  const M33d cones(0.8951, -0.7502, 0.0389, 0.2664, 1.7135, -0.0685, -0.1614, 0.0367, 1.0296);
  const M33d adapted =
      cones * scaling((white_of(shown) * cones) / (white_of(primaries) * cones)) * cones.inverse();
  return xyz_of(primaries) * adapted * xyz_of(shown).inverse();
}

}  // namespace selvedge
