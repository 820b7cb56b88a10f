// Loads what `render` draws: scenes, the levels of fabrics that their frames need, cameras and lights.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/selvedge-view/render_options.h"
#include "viewer/load.h"

namespace selvedge {

/// A scene to draw, and its fabrics.
struct Subject {
  std::string file;
  Scene scene;
  std::vector<Fabric> fabrics;
  std::uint64_t file_bytes = 0;  ///< of the fabric files
};

/// One or two subjects, and how to draw them.
struct Shot {
  std::vector<Subject> subjects;
  std::vector<Camera> cameras;  ///< one for each frame
  RenderOptions options;
  std::vector<Light> own_lights;  ///< of the scene, or of the place of a swatch
  Look look;
};

/// Reads the input, and the scene or fabric to compare with, as far as the frames need them; throws a
/// Failure.
Shot read_shot(const RenderCommand& command);

}  // namespace selvedge
