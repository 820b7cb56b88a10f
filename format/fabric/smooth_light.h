// Light from all around without small bright parts: radiance as polynomials of the direction, which are the
// spherical harmonics of degrees 0 to 2 but for their scale. T is float, double, or WideFloat for several
// pixels.
#pragma once

#include <array>
#include <numbers>

#include "format/base/vec.h"

namespace selvedge {

/// 1, x, y, z, xy, xz, yz, x^2 - y^2, 3 z^2 - 1 of a unit direction. Orthogonal over the sphere.
inline constexpr int smooth_function_count = 9;

template <class T>
constexpr std::array<T, smooth_function_count> smooth_basis(const T& x, const T& y, const T& z) {
  return {T(1), x, y, z, x * y, x * z, y * z, x * x - y * y, T(3) * z * z - T(1)};
}

/// Whether a function changes its sign where z does.
constexpr bool is_odd_in_z(std::size_t function) { return function == 3 || function == 5 || function == 6; }

/// Integrals of the functions' squares over the sphere.
inline constexpr std::array<double, smooth_function_count> smooth_norms = [] {
  constexpr double sphere = 4 * std::numbers::pi;
  return std::array{sphere,      sphere / 3,  sphere / 3,      sphere / 3,    sphere / 15,
                    sphere / 15, sphere / 15, sphere * 4 / 15, sphere * 4 / 5};
}();

/// Radiance sum_k coefficients[k] B_k(direction), linear RGB.
struct SmoothLight {
  std::array<V3f, smooth_function_count> coefficients;
  SmoothLight() { coefficients.fill(V3f(0, 0, 0)); }
  bool operator==(const SmoothLight&) const = default;
};

/// In the plane z = 0.
inline SmoothLight mirrored(SmoothLight light) {
  for (std::size_t k = 0; k < smooth_function_count; ++k)
    if (is_odd_in_z(k)) light.coefficients[k] = -light.coefficients[k];
  return light;
}

/// One colour of a smooth light in other axes, three unit vectors at right angles of either hand: direction d
/// of these axes is d.x x + d.y y + d.z z.
template <class T, class Vec>
constexpr std::array<T, smooth_function_count> turned(const std::array<T, smooth_function_count>& c,
                                                      const Vec& x, const Vec& y, const Vec& z) {
  // The part of degree 2 is d^T Q d.
  const T half(0.5F);
  const T xx = c[7] - c[8];
  const T yy = -c[7] - c[8];
  const T zz = c[8] + c[8];
  const T xy = half * c[4];
  const T xz = half * c[5];
  const T yz = half * c[6];
  const auto along = [&](const Vec& a) { return c[1] * a.x + c[2] * a.y + c[3] * a.z; };
  const auto times = [&](const Vec& a) {
    return Vec{xx * a.x + xy * a.y + xz * a.z, xy * a.x + yy * a.y + yz * a.z,
               xz * a.x + yz * a.y + zz * a.z};
  };
  const auto dot = [](const Vec& a, const Vec& b) { return a.x * b.x + a.y * b.y + a.z * b.z; };
  const Vec of_x = times(x);
  const Vec of_y = times(y);
  const Vec of_z = times(z);
  return {c[0],
          along(x),
          along(y),
          along(z),
          T(2) * dot(x, of_y),
          T(2) * dot(x, of_z),
          T(2) * dot(y, of_z),
          half * (dot(x, of_x) - dot(y, of_y)),
          half * dot(z, of_z)};
}

/// All of a smooth light in other axes.
inline SmoothLight turned(const SmoothLight& light, const V3f& x, const V3f& y, const V3f& z) {
  SmoothLight result;
  for (int c = 0; c < 3; ++c) {
    std::array<float, smooth_function_count> colour{};
    for (std::size_t k = 0; k < smooth_function_count; ++k) colour[k] = light.coefficients[k][c];
    colour = turned(colour, x, y, z);
    for (std::size_t k = 0; k < smooth_function_count; ++k) result.coefficients[k][c] = colour[k];
  }
  return result;
}

}  // namespace selvedge
