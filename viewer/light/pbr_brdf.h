// glTF 2.0's metallic-roughness material (specification, appendix B): a Lambertian base under a layer of GGX
// microfacets with Smith's separable masking and shadowing and Schlick's Fresnel term. Templates for one or
// many pixels; pbr_brdf.glsl is the GLSL twin, held to this one by tests.
#pragma once

#include <cmath>
#include <numbers>

#include "format/scene/footprint.h"
#include "format/simd/wide_float.h"

namespace selvedge {

/// Material at one point, factors and textures multiplied; all in [0, 1].
template <class T>
struct PbrPoint {
  T red, green, blue;  ///< base colour, linear
  T metallic;
  T roughness;  ///< glTF's: the square root of the distribution's alpha
};

template <class T>
struct PbrColour {
  T red, green, blue;
};

/// Three numbers in any orthonormal frame.
template <class T>
struct PbrVector {
  T x, y, z;
};

/// Minimum alpha^2: the highlight of a point light on a perfect mirror would have no size.
inline constexpr float min_alpha2 = 1e-6F;
/// Reflectance of dielectrics at normal incidence.
inline constexpr float dielectric_f0 = 0.04F;

template <class T>
SELVEDGE_INLINE T pbr_dot(const PbrVector<T>& a, const PbrVector<T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
SELVEDGE_INLINE T larger(const T& a, const T& b) {
  return if_greater(a, b, a, b);
}

/// mix(at 0, at 1, metallic).
template <class T>
SELVEDGE_INLINE T pbr_f0(const T& base, const T& metallic) {
  return T(dielectric_f0) + (base - T(dielectric_f0)) * metallic;
}
/// (1 - x)^5 for x in [0, 1]; 0 beyond.
template <class T>
SELVEDGE_INLINE T fifth_power_below(const T& x) {
  const T rest = larger(T(1) - x, T(0));
  return rest * rest * (rest * rest) * rest;
}

/// BRDF times cosine, 1/sr; 0 if the light lies behind the surface. n, v, l are unit vectors: the normal,
/// towards viewer and light. The cosine to the viewer is absolute, as in the specification.
template <class T>
SELVEDGE_INLINE PbrColour<T> pbr_brdf(const PbrPoint<T>& m, const PbrVector<T>& n, const PbrVector<T>& v,
                                      const PbrVector<T>& l) {
  using std::sqrt;
  const T zero(0);
  const T one(1);
  const T nl = larger(pbr_dot(n, l), zero);
  const T nv_signed = pbr_dot(n, v);
  const T nv = larger(nv_signed, -nv_signed);
  PbrVector<T> h{v.x + l.x, v.y + l.y, v.z + l.z};
  const T scale = one / sqrt(larger(pbr_dot(h, h), T(1e-12F)));
  h = {h.x * scale, h.y * scale, h.z * scale};
  const T nh = pbr_dot(n, h);
  const T alpha = m.roughness * m.roughness;
  const T a2 = larger(alpha * alpha, T(min_alpha2));
  // (N.H)^2 (a2 - 1) + 1 without its cancellation near N = H.
  const PbrVector<T> c{n.y * h.z - n.z * h.y, n.z * h.x - n.x * h.z, n.x * h.y - n.y * h.x};
  const T spread = nh * nh * a2 + pbr_dot(c, c);
  const T d = if_greater(nh, zero, a2 / (T(std::numbers::pi_v<float>) * spread * spread), zero);
  const T visibility =
      one / ((nl + sqrt(a2 + (one - a2) * nl * nl)) * (nv + sqrt(a2 + (one - a2) * nv * nv)));
  const T specular = visibility * d;
  const T schlick = fifth_power_below(pbr_dot(v, h));
  // Light reflected at the surface of a mixed material's dielectric share does not reach its base.
  const T below = one - (T(dielectric_f0) + T(1 - dielectric_f0) * schlick);
  const T diffuse = below * (one - m.metallic) * T(std::numbers::inv_pi_v<float>);
  const auto channel = [&](const T& base) __attribute__((always_inline)) {
    const T f0 = pbr_f0(base, m.metallic);
    const T f = f0 + (one - f0) * schlick;
    return (diffuse * base + f * specular) * nl;
  };
  return {channel(m.red), channel(m.green), channel(m.blue)};
}

/// Radiance reflected from light from all around: `mean`: of a white Lambertian surface, `mirrored`
/// what the lobe gathers, and of even light its specular part reflects f0 * scale + bias (reflections.h).
/// Light that the formula loses between facets comes back, as often as they mirror it (Fdez-Aguera 2019): a
/// white metal in even light cannot be seen.
template <class T>
SELVEDGE_INLINE PbrColour<T> pbr_around(const PbrPoint<T>& m, const T& scale, const T& bias,
                                        const PbrColour<T>& mean, const PbrColour<T>& mirrored) {
  const T one(1);
  const T lost = one - scale - bias;
  const auto once = [&](const T& f0) __attribute__((always_inline)) { return f0 * scale + bias; };
  const auto more = [&](const T& f0) __attribute__((always_inline)) {
    const T average = f0 + (one - f0) * T(1.0F / 21);
    return lost * once(f0) * average / (one - lost * average);
  };
  const T of_dielectric(dielectric_f0);
  const T more_of_dielectric = more(of_dielectric);
  const T diffuse = (one - once(of_dielectric) - more_of_dielectric) * (one - m.metallic);
  const auto channel = [&](const T& base, const T& of_mean, const T& of_lobe) __attribute__((always_inline)) {
    const T again = more_of_dielectric + (more(base) - more_of_dielectric) * m.metallic;
    return (diffuse * base + again) * of_mean + once(pbr_f0(base, m.metallic)) * of_lobe;
  };
  return {channel(m.red, mean.red, mirrored.red), channel(m.green, mean.green, mirrored.green),
          channel(m.blue, mean.blue, mirrored.blue)};
}

}  // namespace selvedge
