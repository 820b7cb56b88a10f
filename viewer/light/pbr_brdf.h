// glTF 2.0's metallic-roughness material (specification, appendix B): a Lambertian base under a layer of GGX
// microfacets with Smith's separable masking and shadowing and Schlick's Fresnel term.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "format/base/vec.h"

namespace selvedge {

/// Material at one point, factors and textures multiplied; all in [0, 1].
struct PbrPoint {
  V3f base_color{1, 1, 1};  ///< colour, linear
  float metallic = 0;
  float roughness = 1;  ///< glTF's: the square root of the distribution's alpha
};

/// Minimum alpha^2: the highlight of a point light on a perfect mirror would have no size.
inline constexpr float min_alpha2 = 1e-6F;
/// Reflectance of dielectrics at normal incidence.
inline constexpr float dielectric_f0 = 0.04F;

/// mix(at 0, at 1, metallic).
inline V3f pbr_f0(const PbrPoint& m) {
  return V3f(dielectric_f0) + (m.base_color - V3f(dielectric_f0)) * m.metallic;
}
/// (1 - x)^5 for x in [0, 1]; 0 beyond.
inline float schlick_fifth_power(float x) {
  const float rest = std::max(1 - x, 0.0F);
  return rest * rest * (rest * rest) * rest;
}

/// BRDF times cosine, 1/sr; 0 if the light lies behind the surface. n, v, l are unit vectors in any
/// orthonormal frame: the normal, towards viewer and light. The cosine to the viewer is absolute, as in the
/// specification.
inline V3f pbr_brdf(const PbrPoint& m, const V3f& n, const V3f& v, const V3f& l) {
  const float nl = std::max(n.dot(l), 0.0F);
  const float nv = std::abs(n.dot(v));
  V3f h = v + l;
  h *= 1 / std::sqrt(std::max(h.dot(h), 1e-12F));
  const float nh = n.dot(h);
  const float alpha = m.roughness * m.roughness;
  const float a2 = std::max(alpha * alpha, min_alpha2);
  // (N.H)^2 (a2 - 1) + 1 without its cancellation near N = H.
  const float spread = nh * nh * a2 + n.cross(h).length2();
  const float d = nh > 0 ? a2 / (std::numbers::pi_v<float> * spread * spread) : 0;
  const float visibility =
      1 / ((nl + std::sqrt(a2 + (1 - a2) * nl * nl)) * (nv + std::sqrt(a2 + (1 - a2) * nv * nv)));
  const float schlick = schlick_fifth_power(v.dot(h));
  // Light reflected at the surface of a mixed material's dielectric fraction does not reach its base.
  const float below = 1 - (dielectric_f0 + (1 - dielectric_f0) * schlick);
  const V3f diffuse = m.base_color * (below * (1 - m.metallic) * std::numbers::inv_pi_v<float>);
  const V3f f0 = pbr_f0(m);
  return (diffuse + (f0 + (V3f(1) - f0) * schlick) * (visibility * d)) * nl;
}

/// Radiance reflected from light from all around: `mean`: of a white Lambertian surface, `mirrored`
/// what the lobe gathers, and of even light its specular part reflects f0 * scale + bias (reflections.h).
/// Multiple scattering between facets is added as Fdez-Aguera 2019 does: a white metal in even light cannot
/// be seen.
inline V3f pbr_environment(const PbrPoint& m, float scale, float bias, const V3f& mean, const V3f& mirrored) {
  const float lost = 1 - scale - bias;
  const auto once = [&](float f0) { return f0 * scale + bias; };
  const auto more = [&](float f0) {
    const float average = f0 + (1 - f0) / 21;
    return lost * once(f0) * average / (1 - lost * average);
  };
  const float more_of_dielectric = more(dielectric_f0);
  const float diffuse = (1 - once(dielectric_f0) - more_of_dielectric) * (1 - m.metallic);
  const V3f f0 = pbr_f0(m);
  V3f sum;
  for (int c = 0; c < 3; ++c) {
    const float again = more_of_dielectric + (more(m.base_color[c]) - more_of_dielectric) * m.metallic;
    sum[c] = (diffuse * m.base_color[c] + again) * mean[c] + once(f0[c]) * mirrored[c];
  }
  return sum;
}

}  // namespace selvedge
