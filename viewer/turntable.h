// The cameras of a series of frames.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "format/scene/camera.h"

namespace selvedge {

/// One camera as make_camera() makes it, or `frames` of them once around the scene, in equal steps, all
/// looking at the same point from the same distance: unless the options say which, the scene's centre and the
/// distance from which the frame shows everything all the way round.
Result<std::vector<Camera>> turntable(std::span<const V3d> points, double aspect,
                                      const CameraOptions& options, int frames);

/// "name.png" -> "name-0001.png" for frame 0.
std::string frame_path(const std::string& path, int frame);

}  // namespace selvedge
