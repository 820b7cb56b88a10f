// A lower bound of the step between neighbouring pixels on a texture, without drawing: how coarse a texture
// may be. footprint.h computes the footprint of a single pixel.
#pragma once

#include <array>
#include <functional>

#include "format/scene/camera.h"

namespace selvedge {

/// Of a triangle at `points` (world, m) with texture coordinates `at`: a lower bound of the step, in their
/// units, between some pixel of it and its neighbour to the right or above, the longer of the two, in frames
/// from `camera`; infinite if no pixel shows the triangle.
using StepBound = std::function<double(const std::array<V3d, 3>& points, const std::array<V2d, 3>& at)>;
/// For frames of `height` pixels. `camera` must outlive it.
StepBound step_bound(const Camera& camera, int height);

}  // namespace selvedge
