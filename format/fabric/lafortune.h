// The reflectance formula of the fabric: Daubert et al. 2001, section 3, equation (2), after Lafortune et al.
// 1997, as a template for scalars and vectors:
//
//   g(l, v) = max(0, l_z) * ( rho + sum_j max(0, Cx_j l_x v_x + Cy_j l_y v_y + Cz_j l_z v_z)^n_j )
//
// l and v are unit vectors in the texel's own frame (tangent, binormal, normal), both pointing away from
// the surface. g is the radiance under unit perpendicular irradiance, in 1/sr: the cosine of the light is
// included. A Lambert texel of a given albedo has rho = albedo / pi and no lobes.
#pragma once

#include <cmath>

#include "format/simd/wide.h"

namespace selvedge {

/// Number of parameters of one colour channel: rho, then (Cx, Cy, Cz, n) per lobe.
constexpr int parameter_count(int lobes) { return 1 + 4 * lobes; }

/// base^exponent if the base is positive, else 0 for any exponent. wide_float.h has it for vectors.
template <class T>
SELVEDGE_INLINE T positive_power(const T& base, const T& exponent) {
  using std::pow;
  return base > T(0) ? T(pow(base, exponent)) : T(0);
}

/// The bracket of equation (2), without the cosine. `p` has parameter_count(lobes) values of one channel. A
/// lobe with a base that is not positive contributes 0 for any exponent; with exponent 0 and a positive base
/// it contributes 1. T is float, double, a scalar of automatic differentiation or a vector of several texels.
template <class T, class D>
SELVEDGE_INLINE T lafortune_lobes(const T* p, int lobes, const D* l, const D* v) {
  T sum = p[0];
  for (int j = 0; j < lobes; ++j) {
    const T* lobe = p + 1 + 4 * j;
    const T base = lobe[0] * (l[0] * v[0]) + lobe[1] * (l[1] * v[1]) + lobe[2] * (l[2] * v[2]);
    sum += positive_power(base, lobe[3]);
  }
  return sum;
}

/// Equation (2) whole: zero where the light is below the texel's horizon.
template <class T, class D>
T lafortune(const T* p, int lobes, const D* l, const D* v) {
  if (!(l[2] > D(0))) return T(0);
  return lafortune_lobes(p, lobes, l, v) * l[2];
}

}  // namespace selvedge
