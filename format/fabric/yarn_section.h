// Flat sections of yarn (spec/brdf.md, "Flat yarn"). A linear map p - g (g.p) makes the section round: what
// is said of round yarn holds there, and normals and fibres are mapped back.
#pragma once

#include <cmath>

#include "format/base/vec.h"

namespace selvedge {

/// Thickness over width of a yarn's section where it lies level.
inline constexpr float min_flattening = 0.3F;

/// g of yarn that is as flat all along: level and across the yarn; |g|^2 = 1 - thickness over width, which
/// fades where the yarn stands steeply. `way`: unit, along the yarn's axis, not along its plies.
template <class T>
Imath::Vec3<T> squeeze_of(T flattening, const Imath::Vec3<T>& way) {
  const T scale = std::sqrt((1 - flattening) * (1 + way.z * way.z));
  return {way.y * scale, -way.x * scale, 0};
}

/// Interpolates two squeezes; g and -g are the same section.
template <class T>
Imath::Vec3<T> squeeze_between(const Imath::Vec3<T>& a, const Imath::Vec3<T>& b, T fraction) {
  return a * (1 - fraction) + (a.dot(b) < 0 ? -b : b) * fraction;
}

/// p - g (g.p): an offset from the axis, as it is in the round section. Normals are mapped back by it.
template <class T>
Imath::Vec3<T> squeezed(const Imath::Vec3<T>& p, const Imath::Vec3<T>& squeeze) {
  return p - squeeze * squeeze.dot(p);
}

/// The inverse: offsets and directions along the surface are mapped back by it.
template <class T>
Imath::Vec3<T> stretched(const Imath::Vec3<T>& p, const Imath::Vec3<T>& squeeze) {
  return p + squeeze * (squeeze.dot(p) / (1 - squeeze.length2()));
}

/// Radius of the round section, which is half the thickness: the area equals a circle's of `radius`.
template <class T>
T round_section_radius(T radius, const Imath::Vec3<T>& squeeze) {
  return radius * std::sqrt(1 - squeeze.length2());
}

/// How far the section reaches in a unit direction: as the ellipsoid whose widest section it is. `thin`: half
/// the thickness.
template <class T>
T section_extent(T thin, const Imath::Vec3<T>& squeeze, const Imath::Vec3<T>& direction) {
  return thin * stretched(direction, squeeze).length();
}

}  // namespace selvedge
