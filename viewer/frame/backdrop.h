// The environment behind a picture.
#pragma once

#include "format/picture/environment.h"
#include "format/picture/frame.h"
#include "format/scene/camera.h"

namespace selvedge {

/// Composites the frame over what the camera sees of the environment; the frame is opaque then.
void add_backdrop(const Camera& camera, const Environment& environment, Frame& frame);

}  // namespace selvedge
