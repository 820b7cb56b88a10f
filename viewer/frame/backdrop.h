// The environment behind a picture.
#pragma once

#include <functional>

#include "format/picture/frame.h"
#include "format/scene/camera.h"

namespace selvedge {

/// Composites the frame over what the camera sees of the environment; the frame is opaque then. `radiance` is
/// the environment's towards a unit direction, world.
void add_backdrop(const Camera& camera, const std::function<V3f(const V3d&)>& radiance, Frame& frame);

}  // namespace selvedge
