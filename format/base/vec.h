// The vector and matrix types of the project: Imath's.
#pragma once

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

namespace selvedge {

using Imath::M44d;
using Imath::V2d;
using Imath::V2f;
using Imath::V2i;
using Imath::V3d;
using Imath::V3f;
using Imath::V3i;
using Imath::V4f;

/// Linear interpolation: a where share is 0, b where it is 1.
inline V3f mix(const V3f& a, const V3f& b, float share) { return a + (b - a) * share; }

}  // namespace selvedge
