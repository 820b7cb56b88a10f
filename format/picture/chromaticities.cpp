#include "format/picture/chromaticities.h"

#include <Imath/ImathMatrix.h>

#include <algorithm>
#include <cmath>

#include "format/base/vec.h"

namespace selvedge {
namespace {

using Imath::M33d;

constexpr Chromaticities rec709{0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290};

/// XYZ of brightness 1.
V3d xyz_of(double x, double y) { return {x / y, 1, (1 - x - y) / y}; }

M33d rows(const V3d& a, const V3d& b, const V3d& c) { return {a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z}; }

/// RGB -> XYZ for row vectors: the primaries, scaled so that (1, 1, 1) is white.
M33d to_xyz(const Chromaticities& c) {
  const V3d red = xyz_of(c[0], c[1]);
  const V3d green = xyz_of(c[2], c[3]);
  const V3d blue = xyz_of(c[4], c[5]);
  const V3d scale = xyz_of(c[6], c[7]) * rows(red, green, blue).inverse();
  return rows(red * scale.x, green * scale.y, blue * scale.z);
}

}  // namespace

void convert_to_rec709(const Chromaticities& given, std::span<float> rgba) {
  constexpr double tolerance = 1e-3;
  const auto is_near = [](double a, double b) { return std::abs(a - b) < tolerance; };
  const double area =
      (given[2] - given[0]) * (given[5] - given[1]) - (given[4] - given[0]) * (given[3] - given[1]);
  const bool is_triangle = std::abs(area) > tolerance && given[7] > tolerance &&
                           std::min({std::abs(given[1]), std::abs(given[3]), std::abs(given[5])}) > 0;
  if (!is_triangle || std::ranges::equal(given, rec709, is_near)) return;
  // Bradford's cone responses, in which whites are scaled (Lam 1985; ICC.1:2022, annex E).
  const M33d cones = rows({0.8951, -0.7502, 0.0389}, {0.2664, 1.7135, -0.0685}, {-0.1614, 0.0367, 1.0296});
  const V3d scale = xyz_of(rec709[6], rec709[7]) * cones / (xyz_of(given[6], given[7]) * cones);
  const M33d adaptation = cones * M33d(scale.x, 0, 0, 0, scale.y, 0, 0, 0, scale.z) * cones.inverse();
  const M33d whole = to_xyz(given) * adaptation * to_xyz(rec709).inverse();
  for (std::size_t i = 0; i + 3 < rgba.size(); i += 4) {
    const V3f converted(V3d(rgba[i], rgba[i + 1], rgba[i + 2]) * whole);
    for (int c = 0; c < 3; ++c) rgba[i + c] = converted[c];
  }
}

}  // namespace selvedge
