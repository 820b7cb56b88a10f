// Which mip levels a frame can ask for, known before any of them is read.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "format/camera.h"
#include "format/scene.h"
#include "viewer/index_pass.h"

namespace selvedge {

/// The finest level that a pixel of a frame of `height` pixels can see of each fabric, clamped to those that
/// it has; the coarsest where no triangle of it can be seen. `sizes[i]`: of level 0 of fabric i, powers of
/// two, else 0 is given for it; `counts[i]`: its number of levels. Never too coarse: per triangle it takes
/// the smaller stretch of the texture and the nearest depth, and the frame's widest angle; and with linear
/// taps a level more, since the first level that is there is not taken linearly. Precondition: materials name
/// fabrics that exist.
std::vector<int> finest_levels(const Scene& scene, const Camera& camera, int height,
                               const LevelOptions& options, std::span<const V2i> sizes,
                               std::span<const int> counts);

}  // namespace selvedge
