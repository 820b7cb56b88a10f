// The state that the window of `show` edits, and its changes by mouse and keys; independent of the window.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "format/picture/display.h"
#include "format/scene/lights.h"
#include "viewer/renderer.h"
#include "viewer/scene/change_fabrics.h"

namespace selvedge {

/// An environment, neither turned nor scaled, and its light.
struct Surroundings {
  std::string name;
  Environment environment;
  EnvironmentLight light;
};

/// Fabrics of the materials.
struct FabricChoice {
  std::vector<int> fabrics;  ///< index into the fabrics; -1: the core material
  std::vector<FabricFit> fits;
};

struct ShowState {
  CameraOptions camera;           ///< an orbit (orbit.h)
  std::vector<Light> lights;      ///< see lights_in_camera_frame
  std::size_t dragged_light = 0;  ///< index of the light that drags turn
  /// Whether directional lights are in the camera's axes, else in the world's.
  bool lights_in_camera_frame = true;
  std::vector<std::shared_ptr<const Surroundings>> environments;  ///< to choose from
  int environment = -1;                                           ///< of these; -1: none
  float environment_turn = 0;                                     ///< of the environment, EnvironmentOptions
  float environment_strength = 1;                                 ///< of the environment, EnvironmentOptions
  bool has_backdrop = false;                                      ///< it is shown behind the scene
  float backdrop_roughness = 0;                                   ///< as by a mirror of this roughness
  float ambient_irradiance = 0;                                   ///< radiance from all sides, times pi
  int shadow_map_size = 0;                                        ///< as in DrawOptions
  DisplayOptions display;
  LevelOptions levels;
  int layers = 8;
  std::size_t image_memory_bytes = CellImageOptions{}.memory_bytes;
  int path = static_cast<int>(RenderPath::raster);
  FabricChoice worn_fabrics;
  std::vector<int> hidden_fabrics;  ///< the fabrics while the core materials are shown, or empty
  /// Worn left of the bar, to be compared.
  std::optional<FabricChoice> compared_fabrics;
  float comparison_bar = 0.5F;  ///< in [0, 1], from the left side of the picture
  bool shows_probe = true;
  int clip = -1;                    ///< of the file; -1: none
  double clip_time = 0;             ///< s
  float clip_speed = 1;             ///< seconds of the clip in one of the clock
  bool plays_clip = true;           ///< else it is paused
  double frame_seconds = 1.0 / 30;  ///< within which a picture that moves is drawn, smaller if need be
};

/// The work that a change requires; each value includes those before it.
enum class Redraw { none, display, frame, scene };

/// Mouse input over the picture since the last call.
struct ShowInput {
  enum class Grip { turn, pan, light };
  Grip grip = Grip::turn;
  V2d drag{0, 0};                        ///< in heights of the window, x to the right, y up
  double wheel = 0;                      ///< steps; positive towards the scene
  V2d cursor{0, 0};                      ///< in [-1, 1]^2, y up
  std::optional<V3d> cursor_point = {};  ///< the point under the cursor; world, m
  bool has_motion() const { return drag != V2d(0, 0) || wheel != 0; }
};

/// `aspect` of the window; `size` of the scene in metres.
Redraw apply(const ShowInput& input, double aspect, double size, ShowState& state);

/// Turns the environment, or without one the held light, by a drag. Does nothing without a light, or if
/// it is a point or spot light.
void turn_dragged_light(const V2d& drag, const Camera& camera, ShowState& state);

/// Puts the next of `count` fabrics on every material that has one. Returns whether anything changed.
bool wear_next_fabric(int count, ShowState& state);

/// Takes the fabrics away, so that the core materials show, or puts them back. Returns whether anything
/// changed.
bool toggle_core_materials(ShowState& state);

/// Keeps what is worn beside what will be chosen from now on, or ends that.
Redraw toggle_comparison(ShowState& state);

/// Converts the lights' directions to the other axes; the picture does not change.
void switch_light_frame(ShowState& state);

/// The exposure that shows white as white in the chosen light: 1 in an environment, else pi.
float default_exposure(const ShowState& state);

/// The lights in world space, with the environment's lamps.
std::vector<Light> lights_in_world(const ShowState& state, const Camera& camera);

/// Smooth light from all around: the rest of the environment, and ambient light.
std::optional<SmoothLight> smooth_light_in_world(const ShowState& state);

/// How much smaller a moving picture is drawn. Sizes change by steps of 1.26 a side, after two frames in a
/// row that say so: they do not alternate, nor follow what another program does for a moment.
class FramePace {
 public:
  double size_divisor() const;  ///< per side, 1 to 4
  /// A moving frame took so long.
  void add_frame(double seconds, double budget);

 private:
  static constexpr int coarsest = 6;
  int step_ = coarsest;
  int held_ = 0;     ///< frames for which no step goes to finer pictures
  double last_ = 0;  ///< steps that the frame before asks for
};

}  // namespace selvedge
