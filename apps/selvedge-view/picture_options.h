// Options of pictures that `render` and `show` share: lights, levels, display, swatches.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/common/options.h"
#include "format/gltf/limits.h"
#include "format/picture/display.h"
#include "format/picture/environment.h"
#include "viewer/render.h"
#include "viewer/swatch.h"

namespace selvedge {

struct PictureOptions {
  std::string input;
  SceneLimits limits;                   ///< scenes
  CameraOptions camera;                 ///< scenes
  SwatchOptions swatch;                 ///< fabric files
  std::vector<Light> lights;            ///< empty: those of the scene, else the default lights
  bool lights_in_camera_frame = false;  ///< directional lights are in the camera's axes
  DisplayOptions display = default_display();
  float ambient = RenderOptions{}.ambient;
  int shadows = RenderOptions{}.shadows;
  bool no_shadows = false;
  LevelOptions levels = best_levels;
  int layers = RenderOptions{}.layers;
  std::string environment;    ///< a picture of radiance; empty: none
  EnvironmentOptions around;  ///< of it
  bool backdrop = false;      ///< it is shown, too
};

/// The input, levels and layers.
void add_input(Options& options, PictureOptions& picture);
/// --repeats of a swatch.
void add_repeats(Options& options, SwatchOptions& swatch);
/// --environment with its turn and strength.
void add_environment(Options& options, std::string& file, EnvironmentOptions& environment);
/// Lights and display options.
void add_light(Options& options, PictureOptions& picture);
/// Refuses those of these options that have no effect beside the others.
void check_picture(const Options& options, const PictureOptions& picture);

/// The lights of the options, else those of the scene, else the default ones, which an environment replaces.
std::vector<Light> lights_for(const PictureOptions& picture, const Scene& scene, const Camera& camera);

/// An environment, and its light.
struct Surroundings {
  std::shared_ptr<const Environment> environment;
  EnvironmentLight light;
};
/// That of the options; nothing if they have none.
Result<std::optional<Surroundings>> surroundings_of(const PictureOptions& picture);

}  // namespace selvedge
