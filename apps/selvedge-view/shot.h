// Loads what `render` draws: a scene with its fabrics, cameras and lights.
#pragma once

#include <vector>

#include "apps/selvedge-view/render_options.h"
#include "viewer/load.h"

namespace selvedge {

struct Shot : LoadedScene {
  std::vector<Camera> cameras;  ///< one for each frame
  RenderOptions options;
  Look look;
};

/// Throws a Failure.
Shot read_shot(const RenderCommand& command);

}  // namespace selvedge
