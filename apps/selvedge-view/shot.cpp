#include "apps/selvedge-view/shot.h"

#include <algorithm>

#include "format/base/option_text.h"
#include "format/scene/framing.h"
#include "viewer/orbit.h"

namespace selvedge {
namespace {

/// The swatch of a fabric file; adds the lights of its place to `own_lights`.
void read_swatch(const RenderCommand& command, Shot& shot, std::vector<Light>& own_lights) {
  auto reader = value_or_throw(FabricReader::open(command.picture.input));
  MemoryBudget memory(command.picture.limits.document.memory);
  const Fabric& fabric = shot.fabrics.emplace_back(value_or_throw(load_fabric(reader, memory)));
  Swatch swatch;
  if (command.place) {
    const V2d period(fabric.period_mm);
    SwatchShot place = swatch_shot(*command.place, period, command.size.x, command.size.y);
    swatch = Swatch{swatch_scene(period, place), place.camera, place.width, place.height};
    own_lights = std::move(place.lights);
  } else {
    swatch = value_or_throw(make_swatch(fabric, command.picture.swatch));
  }
  shot.scene = std::move(swatch.scene);
  shot.scene.file = command.picture.input;
  shot.scene.fabrics.emplace_back().name = command.picture.input;
  shot.scene.memory_left = memory.unspent_bytes();
  shot.fabric_memory = memory.limit() - memory.unspent_bytes();
  shot.options.width = swatch.width;
  shot.options.height = swatch.height;
  shot.options.layers = 1;
  shot.cameras = {swatch.camera};
}

std::vector<Camera> cameras_of(const RenderCommand& command, Scene& scene) {
  const double aspect = static_cast<double>(command.size.x) / command.size.y;
  CameraOptions options = command.picture.camera;
  if (!command.file_camera.empty()) {
    const auto points = value_or_throw(world_points(scene));
    return {value_or_throw(find_scene_camera(scene, command.file_camera, points, aspect, options))};
  }
  const Framing framing = value_or_throw(frame_scene(scene));
  if (!command.has_view_angles) {
    options.azimuth = framing.azimuth;
    options.elevation = framing.elevation;
    if (!framing.turn_remark.empty()) scene.remarks.push_back(framing.turn_remark);
  }
  scene.remarks.insert(scene.remarks.end(), framing.stray_remarks.begin(), framing.stray_remarks.end());
  std::vector<Camera> cameras;
  if (command.turntable > 0)
    cameras = value_or_throw(turntable(framing.points, aspect, options, command.turntable));
  else
    cameras = {value_or_throw(make_camera(framing.points, aspect, options))};
  for (Camera& camera : cameras) widen_clipping_depths(framing.excluded_corners, camera);
  return cameras;
}

}  // namespace

Shot read_shot(const RenderCommand& command) {
  Shot shot;
  shot.options = command.render;
  shot.options.width = command.size.x;
  shot.options.height = command.size.y;
  shot.options.levels = command.picture.levels;
  shot.options.cells.samples_per_pixel_side = image_samples(command.render.supersample);
  shot.options.cells.memory_bytes = std::size_t{1} * command.picture.image_memory_mib << 20;
  shot.options.layers = command.picture.layers;
  std::vector<Light> own_lights;
  if (has_ending(command.picture.input, ".exr")) {
    read_swatch(command, shot, own_lights);
  } else {
    static_cast<LoadedScene&>(shot) =
        value_or_throw(load_scene(command.picture.input, command.choice, command.picture.limits));
    shot.cameras = cameras_of(command, shot.scene);
    own_lights = scene_lights(shot.scene);
  }
  std::uint64_t& memory = shot.scene.memory_left;
  shot.look = value_or_throw(look_of(command.picture, own_lights, memory));
  if (shot.look.environment)
    memory -= std::min(memory, shot.look.environment->radiance.size() * environment_bytes_per_pixel);
  shot.options.shadow_map_size = shot.look.shadow_map_size;
  if (shot.look.has_smooth_light()) shot.options.smooth_light = shot.look.light.smooth_light;
  shot.options.mirrored_ambient_irradiance = static_cast<float>(command.picture.ambient_irradiance);
  shot.options.environment = shot.look.environment;
  if (command.picture.has_backdrop) shot.options.backdrop_roughness = command.picture.backdrop_roughness;
  return shot;
}

}  // namespace selvedge
