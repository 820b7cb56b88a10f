// BRDF of yarn as a template: Lambertian, and a highlight of its fibres.
//
//   f(l, v) = (1 - w) albedo B(l, v) + w D(h) G(l, v) / (4 l.n v.n),   h = (l + v) / |l + v|
//
// D and G are Walter et al.'s GGX microfacets with Smith's height-correlated masking (Heitz 2014),
// of width r (the roughness) along the fibre and 1 across it. Width 1 is exact for a round fibre: the normals
// of a cylinder have the slope density (1 + s^2)^(-3/2) / 2. Facets reflect all light. f is symmetric in l
// and v; the gloss reflects at most 1 (light that facets block is lost).
//
// B is the body: light that passes through fibres leaves them at the angle to their axis at which it came, as
// the light that their surfaces reflect does, but coloured and less sharp (Sadeghi et al. 2013, "A practical
// microcylinder appearance model for cloth rendering"). With the components x and y of l and v along the
// fibre and the lustre s it is
//
//   B = (1 - s^2) / (pi ((1 - s^2)^2 + 4 s (1 + s^2) x y + 4 s^2 (x^2 + y^2))),
//
// matt about the fibre, and about y = -x along it. A cosine-weighted hemisphere has the semicircle as density
// of x, whose Mehler kernel this is: all light is reflected, from any direction, and B is 1 / pi where s = 0.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "format/base/vec.h"

namespace selvedge {

/// The specular highlight of a yarn's fibres.
struct Gloss {
  float weight = 0;        ///< fraction of the light that it reflects, in [0, 1]; 0: Lambertian yarn
  float roughness = 0.3F;  ///< width of the highlight, in (0, 1]
  float lustre = 0;        ///< of the body, in [0, max_lustre]
  bool operator==(const Gloss&) const = default;
};

/// Minimum width: single precision cannot resolve the directions of sharper highlights.
inline constexpr double min_gloss_width = 0.01;
inline constexpr float max_lustre = 0.9F;

/// Smith's Lambda for widths (r, 1). `d`: in the frame (fibre, across, normal), d.z > 0.
template <class T>
T smith_lambda(const Imath::Vec3<T>& d, T r) {
  return (std::sqrt(1 + (r * r * d.x * d.x + d.y * d.y) / (d.z * d.z)) - 1) / 2;
}

/// The gloss without its weight, 1/sr. Unit directions in the frame (fibre, across, normal); 0 below it.
template <class T>
T gloss_reflectance(const Imath::Vec3<T>& l, const Imath::Vec3<T>& v, T roughness) {
  if (!(l.z > 0) || !(v.z > 0)) return 0;
  const T r = std::max(static_cast<T>(min_gloss_width), roughness);
  const Imath::Vec3<T> h = l + v;
  const T q = (h.x * h.x / (r * r) + h.y * h.y + h.z * h.z) / h.length2();
  return 1 /
         (std::numbers::pi_v<T> * r * q * q * (1 + smith_lambda(l, r) + smith_lambda(v, r)) * 4 * l.z * v.z);
}

/// Fraction of uniform light that gloss_reflectance() reflects: a fit to 16 widths, within 6e-4.
template <class T>
T mean_gloss_albedo(T roughness) {
  const T r = roughness;
  return static_cast<T>(0.5848) +
         r * (static_cast<T>(-0.02) + r * (static_cast<T>(-0.2799) + r * static_cast<T>(0.1247)));
}

/// The body, 1/sr, for the components along the fibre.
template <class T>
T body_reflectance(T light_along, T view_along, T lustre) {
  const T s2 = lustre * lustre;
  const T rest = 1 - s2;
  return rest * std::numbers::inv_pi_v<T> /
         (rest * rest + 4 * lustre * (1 + s2) * light_along * view_along +
          4 * s2 * (light_along * light_along + view_along * view_along));
}

/// Factor of the body's reflectance for light with these means of U_1 and U_2 of its component along the
/// fibre, over that for uniform light: body_reflectance() is the sum over n of
/// (-lustre)^n U_n(view_along) U_n(light_along) / pi, of which three terms are kept.
template <class T>
T lustre_factor(T view_along, T lustre, T mean_u1, T mean_u2) {
  const T both = lustre * view_along;
  const T sum = 1 - 2 * both * mean_u1 + (4 * both * both - lustre * lustre) * mean_u2;
  return std::max(T(0), sum);
}

}  // namespace selvedge
