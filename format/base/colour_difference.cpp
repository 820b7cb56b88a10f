#include "format/base/colour_difference.h"

#include <cmath>
#include <numbers>

namespace selvedge {
namespace {

constexpr double degree = std::numbers::pi / 180;

/// L*, a*, b*.
V3d lab(const V3f& c) {
  const auto f = [](double t) { return t > 216.0 / 24389 ? std::cbrt(t) : (24389.0 / 27 * t + 16) / 116; };
  const V3d rgb(c);
  const double x = f(rgb.dot({0.4124564, 0.3575761, 0.1804375}) / 0.95047);
  const double y = f(rgb.dot({0.2126729, 0.7151522, 0.0721750}));
  const double z = f(rgb.dot({0.0193339, 0.1191920, 0.9503041}) / 1.08883);
  return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

/// Hue in degrees, 0 to 360.
double hue(double a, double b) {
  if (a == 0 && b == 0) return 0;
  const double h = std::atan2(b, a) / degree;
  return h < 0 ? h + 360 : h;
}

}  // namespace

double ciede2000(const V3f& first, const V3f& second) {
  const V3d p = lab(first);
  const V3d q = lab(second);
  const auto strength = [](double c) {
    return std::sqrt(std::pow(c, 7) / (std::pow(c, 7) + std::pow(25.0, 7)));
  };
  const double mean = (std::hypot(p.y, p.z) + std::hypot(q.y, q.z)) / 2;
  const double g = 1.5 - 0.5 * strength(mean);
  const double c1 = std::hypot(g * p.y, p.z);
  const double c2 = std::hypot(g * q.y, q.z);
  const double h1 = hue(g * p.y, p.z);
  const double h2 = hue(g * q.y, q.z);
  double turn = c1 * c2 == 0 ? 0 : h2 - h1;
  if (turn > 180) turn -= 360;
  if (turn < -180) turn += 360;
  const double dh = 2 * std::sqrt(c1 * c2) * std::sin(turn * degree / 2);
  const double l = (p.x + q.x) / 2;
  const double c = (c1 + c2) / 2;
  double h = c1 * c2 == 0 ? h1 + h2 : (h1 + h2) / 2;
  if (c1 * c2 != 0 && std::abs(h1 - h2) > 180) h += h1 + h2 < 360 ? 180 : -180;
  const double t = 1 - 0.17 * std::cos((h - 30) * degree) + 0.24 * std::cos(2 * h * degree) +
                   0.32 * std::cos((3 * h + 6) * degree) - 0.2 * std::cos((4 * h - 63) * degree);
  const double sl = 1 + 0.015 * (l - 50) * (l - 50) / std::sqrt(20 + (l - 50) * (l - 50));
  const double sc = 1 + 0.045 * c;
  const double sh = 1 + 0.015 * c * t;
  const double rt = -2 * strength(c) * std::sin(60 * degree * std::exp(-std::pow((h - 275) / 25, 2)));
  const V3d d((q.x - p.x) / sl, (c2 - c1) / sc, dh / sh);
  return std::sqrt(d.length2() + rt * d.y * d.z);
}

}  // namespace selvedge
