// The vector and matrix types of the project: Imath's.
#pragma once

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <span>

namespace selvedge {

using Imath::M44d;
using Imath::V2d;
using Imath::V2f;
using Imath::V2i;
using Imath::V3d;
using Imath::V3f;
using Imath::V3i;
using Imath::V4f;

/// The components of vectors of floats. Imath's vectors have no padding.
template <class Vectors>
std::span<const float> floats_of(const Vectors& vectors) {
  using Vector = typename Vectors::value_type;
  static_assert(sizeof(Vector) == Vector::dimensions() * sizeof(float));
  return {reinterpret_cast<const float*>(vectors.data()), vectors.size() * Vector::dimensions()};
}

/// Linear interpolation: a where fraction is 0, b where it is 1.
inline V3f mix(const V3f& a, const V3f& b, float fraction) { return a + (b - a) * fraction; }

}  // namespace selvedge
