#include "viewer/show/state.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "viewer/orbit.h"

namespace selvedge {
namespace {

V3d to_camera_frame(const Camera& camera, const V3d& d) {
  return {d.dot(camera.right), d.dot(camera.up), d.dot(camera.image_normal())};
}

EnvironmentLight light_of(const ShowState& state) {
  return with_options(
      state.environments[state.environment]->light,
      {static_cast<double>(state.environment_turn), static_cast<double>(state.environment_strength)});
}

}  // namespace

Redraw apply(const ShowInput& input, double aspect, double size, ShowState& state) {
  if (!input.has_motion()) return Redraw::none;
  switch (input.grip) {
    case ShowInput::Grip::turn:
      turn(state.camera, input.drag);
      break;
    case ShowInput::Grip::pan:
      pan(state.camera, input.drag);
      break;
    case ShowInput::Grip::light:
      turn_dragged_light(input.drag, camera_axes(state.camera), state);
      break;
  }
  if (input.wheel > 0 && input.cursor_point) orbit_about(state.camera, *input.cursor_point);
  if (input.wheel != 0) dolly(state.camera, input.wheel, input.cursor, aspect, size);
  return Redraw::frame;
}

void turn_dragged_light(const V2d& drag, const Camera& camera, ShowState& state) {
  if (state.dragged_light >= state.lights.size() ||
      state.lights[state.dragged_light].kind != LightKind::directional) {
    if (state.environment >= 0)
      state.environment_turn =
          static_cast<float>(std::remainder(static_cast<double>(state.environment_turn) + 180 * drag.x, 360));
    return;
  }
  V3d& direction = state.lights[state.dragged_light].direction;
  if (state.lights_in_camera_frame) {
    direction = turn_light(direction, drag);
  } else {
    direction = camera_to_world(camera, turn_light(to_camera_frame(camera, direction), drag));
  }
}

bool wear_next_fabric(int count, ShowState& state) {
  if (count < 1) return false;
  const std::vector<int> before = state.worn_fabrics.fabrics;
  for (int& fabric : state.worn_fabrics.fabrics)
    if (fabric >= 0) fabric = (fabric + 1) % count;
  return state.worn_fabrics.fabrics != before;
}

bool toggle_core_materials(ShowState& state) {
  if (!state.hidden_fabrics.empty()) {
    state.worn_fabrics.fabrics = std::exchange(state.hidden_fabrics, {});
    return true;
  }
  state.hidden_fabrics = state.worn_fabrics.fabrics;
  std::ranges::fill(state.worn_fabrics.fabrics, -1);
  return state.worn_fabrics.fabrics != state.hidden_fabrics;
}

Redraw toggle_comparison(ShowState& state) {
  state.compared_fabrics = state.compared_fabrics ? std::nullopt : std::optional(state.worn_fabrics);
  state.comparison_bar = 0.5F;
  return Redraw::scene;
}

void switch_light_frame(ShowState& state) {
  const Camera camera = camera_axes(state.camera);
  for (Light& light : state.lights) {
    if (light.kind != LightKind::directional) continue;
    light.direction = state.lights_in_camera_frame ? camera_to_world(camera, light.direction)
                                                   : to_camera_frame(camera, light.direction);
  }
  state.lights_in_camera_frame = !state.lights_in_camera_frame;
}

float default_exposure(const ShowState& state) {
  return state.environment >= 0 && state.lights.empty() ? 1 : default_display().exposure;
}

std::vector<Light> lights_in_world(const ShowState& state, const Camera& camera) {
  std::vector<Light> lights =
      state.lights_in_camera_frame ? camera_to_world(camera, state.lights) : state.lights;
  if (state.environment < 0 && lights.empty()) return default_lights(camera);
  if (state.environment >= 0) {
    const std::vector<Light> lamps = light_of(state).lamps;
    lights.insert(lights.end(), lamps.begin(), lamps.end());
  }
  return lights;
}

std::optional<SmoothLight> smooth_light_in_world(const ShowState& state) {
  SmoothLight around;
  if (state.environment >= 0) around = light_of(state).smooth_light;
  around.coefficients[0] += V3f(state.ambient_irradiance * std::numbers::inv_pi_v<float>);
  return around == SmoothLight() ? std::nullopt : std::optional(around);
}

double FramePace::size_divisor() const { return std::exp2(step_ / 3.0); }

void FramePace::add_frame(double seconds, double budget) {
  // Finer where that is sure to be in time, and not in the 20 frames after it was not.
  constexpr double sure = -0.8;
  // Time follows the area.
  const double now = std::clamp(1.5 * std::log2(std::max(seconds, 1e-6) / budget), -9.0, 9.0);
  const double late = std::max(std::ceil(std::min(now, last_)), 0.0);
  const bool is_early = std::max(now, last_) < sure && held_ == 0;
  const double steps = is_early ? std::min(-1.0, std::trunc(std::max(now, last_))) : late;
  held_ = late > 0 ? 20 : std::max(held_ - 1, 0);
  last_ = now - steps;
  step_ = std::clamp(step_ + static_cast<int>(steps), 0, coarsest);
}

}  // namespace selvedge
