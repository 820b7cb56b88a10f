// Options of pictures that `render` and `show` share: lights, levels, display, swatches.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/common/shared_options.h"
#include "format/gltf/limits.h"
#include "format/picture/display.h"
#include "viewer/light/shadows.h"
#include "viewer/renderer.h"
#include "viewer/swatch.h"

namespace selvedge {

struct PictureOptions {
  std::string input;
  SceneLimits limits;                   ///< scenes
  CameraOptions camera;                 ///< scenes
  SwatchOptions swatch;                 ///< fabric files
  std::vector<Light> lights;            ///< empty: the scene's, else the environment
  bool lights_in_camera_frame = false;  ///< directional lights are in the camera's axes
  DisplayOptions display = default_display();
  // Defaults: environment_display() in an environment, else `display`.
  std::optional<double> exposure;
  std::optional<ToneCurve> tone_curve;
  bool has_background = false;                ///< of `display`
  double ambient_irradiance = 0;              ///< radiance from all sides, times pi
  int shadow_map_size = default_shadow_size;  ///< texels per side of maps of scenes; 0: no maps
  LevelOptions levels;
  int layers = RenderOptions{}.layers;
  int image_memory_mib = CellImageOptions{}.memory_bytes >> 20;  ///< MiB
  std::string environment;  ///< a picture of radiance, "studio" or "none"; empty: what suits the input
  EnvironmentOptions environment_options;  ///< of it
  bool has_backdrop = false;               ///< it is shown, too
  float backdrop_roughness = 0;            ///< as by a mirror of this roughness
};

/// The input, levels and layers.
void add_input(Options& options, PictureOptions& picture);
/// --repeats of a swatch.
void add_repeats(Options& options, SwatchOptions& swatch);
/// Lights and display options.
void add_light(Options& options, PictureOptions& picture);
/// Refuses options that have no effect beside others.
void check_picture(const Options& options, const PictureOptions& picture);

/// Lights and display of a picture, with the defaults for the input.
struct Look {
  std::string environment_name;                    ///< of the environment, as its option has it
  std::shared_ptr<const Environment> environment;  ///< null: none
  EnvironmentLight light;                          ///< of the environment and --ambient
  std::vector<Light> lights;                       ///< of the options or the scene; may be in camera axes
  bool lights_in_camera_frame = false;
  DisplayOptions display;
  int shadow_map_size = 0;

  /// All lamps, world axes.
  std::vector<Light> all_lights(const Camera& camera) const;
};

/// `own`: the lights of the scene, or of a swatch at a place, which an environment replaces;
/// `memory` is what the environment may take.
Result<Look> look_of(const PictureOptions& picture, const std::vector<Light>& own, std::uint64_t memory);

}  // namespace selvedge
