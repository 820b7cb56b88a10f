#include "apps/report/colour_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace selvedge {
namespace {

/// Oklab to linear RGB of ITU-R BT.709.
V3d from_oklab(double lightness, double a, double b) {
  const auto cube = [](double x) { return x * x * x; };
  const double l = cube(lightness + 0.3963377774 * a + 0.2158037573 * b);
  const double m = cube(lightness - 0.1055613458 * a - 0.0638541728 * b);
  const double s = cube(lightness - 0.0894841775 * a - 1.2914855480 * b);
  return {4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
          -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
          -0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s};
}

}  // namespace

V3f diverging_colour(double t) {
  constexpr double lightest = 0.975;
  constexpr double darkest = 0.45;
  constexpr double max_chroma = 0.155;  // both ends within the screen's colours
  constexpr double red = 28;            // hues, degrees
  constexpr double blue = 256;
  const double size = std::min(std::abs(t), 1.0);
  const double hue = (t < 0 ? blue : red) * std::numbers::pi / 180;
  // Chroma first: near 0 the sign shows before the size does.
  const double chroma = max_chroma * std::min(1.0, 1.4 * size);
  V3d colour =
      from_oklab(lightest + (darkest - lightest) * size, chroma * std::cos(hue), chroma * std::sin(hue));
  for (int c = 0; c < 3; ++c) colour[c] = std::clamp(colour[c], 0.0, 1.0);
  return V3f(colour);
}

}  // namespace selvedge
