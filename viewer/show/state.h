// What the window of `show` edits, and how hands change it. Knows of no window.
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "format/picture/display.h"
#include "format/scene/lights.h"
#include "viewer/render.h"

namespace selvedge {

struct ShowState {
  CameraOptions camera;        ///< an orbit (orbit.h)
  std::vector<Light> lights;   ///< see lights_in_camera_frame
  std::size_t held_light = 0;  ///< that drags turn
  /// Directions of lights far away are in the camera's axes, else in the world's.
  bool lights_in_camera_frame = true;
  float ambient = RenderOptions{}.ambient;  ///< as there
  int shadows = 0;                          ///< as there
  DisplayOptions display;
  LevelOptions levels;
  int layers = 8;
  int path = 0;              ///< a RenderPath
  std::vector<int> fabrics;  ///< of the materials, index into the fabrics; -1: the core material
  bool texel_edges = false;
  bool probes = true;
};

/// What has to be done again after a change; each includes those before it.
enum class Change { none, display, frame, scene };

/// What a hand did over the picture since the last time.
struct ShowInput {
  enum class Grip { turn, pan, light };
  Grip grip = Grip::turn;
  V2d drag{0, 0};                ///< in heights of the window, x to the right, y up
  double wheel = 0;              ///< steps, above 0 towards the scene
  V2d cursor{0, 0};              ///< in [-1, 1]^2, y up
  std::optional<V3d> seen = {};  ///< what lies under the cursor; world, m
  bool moves() const { return drag != V2d(0, 0) || wheel != 0; }
};

/// `aspect` of the window; `size` of the scene in metres.
Change apply(const ShowInput& input, double aspect, double size, ShowState& state);

/// Turns the held light by a drag; nothing where there is no light, or one that stands somewhere.
void turn_held_light(const V2d& drag, const Camera& camera, ShowState& state);

/// The next of `count` fabrics on every material that has one. Gives whether that changes anything.
bool next_fabrics(int count, ShowState& state);

/// Expresses the lights' directions in the other axes; the picture stays as it is.
void switch_light_frame(const Camera& camera, ShowState& state);

/// The lights in the world.
std::vector<Light> lights_in_world(const ShowState& state, const Camera& camera);

/// The whole number by which a moving picture is drawn smaller per side, so that a frame that takes `seconds`
/// in full comes within `budget`; 1 to 4.
int size_divisor(double seconds, double budget);

}  // namespace selvedge
