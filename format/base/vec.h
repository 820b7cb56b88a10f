// The vector types of the project are Imath's; nothing of our own stands beside them.
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

}  // namespace selvedge
