// Cameras of a turntable, and the names of its frames.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "format/scene/camera.h"

namespace selvedge {

/// One camera by make_camera(), or `frames` cameras once around the scene in equal steps, all looking at the
/// same point from the same distance: of the options, or by default the scene's centre and the distance
/// that shows everything in all frames.
Result<std::vector<Camera>> turntable(std::span<const V3d> points, double aspect,
                                      const CameraOptions& options, int frames);

/// "name.png" -> "name-0001.png" for frame 0.
std::string frame_path(const std::string& path, int frame);

}  // namespace selvedge
