#include "apps/selvedge-view/shot.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>

#include "format/base/option_text.h"
#include "format/scene/framing.h"
#include "viewer/orbit.h"
#include "viewer/scene/change_fabrics.h"

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
  shot.frames.emplace_back().camera = swatch.camera;
  shot.variants.emplace_back();
}

/// The contents of the frame: of a clip at even times, so that all of its frames have one camera.
Framing framing_of(Shot& shot) {
  Framing framing = value_or_throw(frame_scene(shot.scene));
  if (!shot.motion) return framing;
  constexpr int times = 16;
  constexpr std::size_t max_points = std::size_t{1} << 16;
  framing.points.clear();
  for (int i = 0; i < times; ++i) {
    value_or_throw(shot.motion->pose(shot.motion->clip().seconds() * i / times, shot.scene));
    const std::vector<V3d> points = value_or_throw(frame_scene(shot.scene)).points;
    const std::vector<V3d> kept = points.size() > max_points ? box_corners(points) : points;
    framing.points.insert(framing.points.end(), kept.begin(), kept.end());
  }
  return framing;
}

double aspect_of(const RenderCommand& command) {
  return static_cast<double>(command.size.x) / command.size.y;
}

void add_frames(const RenderCommand& command, Shot& shot) {
  const V2i range = command.frames.value_or(V2i(0, 0));
  for (int k = range.x; k <= range.y; ++k) {
    ShotFrame& frame = shot.frames.emplace_back();
    frame.time = command.frames ? k / command.fps : command.time;
    frame.number = k;
    if (command.frames) frame.name = fmt::format("{:04}", k);
  }
  Scene& scene = shot.scene;
  CameraOptions options = command.picture.camera;
  if (!command.file_camera.empty()) {
    const auto points = value_or_throw(world_points(scene));
    const Camera camera =
        value_or_throw(find_scene_camera(scene, command.file_camera, points, aspect_of(command), options));
    for (ShotFrame& frame : shot.frames) frame.camera = camera;
    return;
  }
  const Framing framing = framing_of(shot);
  if (!command.has_view_angles) {
    options.azimuth = framing.azimuth;
    options.elevation = framing.elevation;
    if (!framing.turn_remark.empty()) scene.remarks.push_back(framing.turn_remark);
  }
  scene.remarks.insert(scene.remarks.end(), framing.stray_remarks.begin(), framing.stray_remarks.end());
  if (command.turntable > 0) {
    const ShotFrame still = shot.frames.front();
    shot.frames.clear();
    const auto views = value_or_throw(
        turntable(framing.points, aspect_of(command), options, command.turntable, command.has_top));
    for (const CameraOptions& view : views) {
      ShotFrame& frame = shot.frames.emplace_back(still);
      frame.number = static_cast<int>(shot.frames.size());
      frame.name = frame.number > command.turntable ? "top" : fmt::format("{:04}", frame.number);
      frame.view = view;
    }
  }
  for (ShotFrame& frame : shot.frames) {
    frame.camera =
        value_or_throw(make_camera(framing.points, aspect_of(command), frame.view.value_or(options)));
    widen_clipping_depths(framing.excluded_corners, frame.camera);
  }
}

/// The variants of the options; their fabrics are loaded.
void add_variants(const RenderCommand& command, Shot& shot) {
  const std::vector<std::string>& names = shot.scene.variants;
  for (const std::string& wanted : command.variants) {
    if (wanted == "all" && std::ranges::find(names, wanted) == names.end()) {
      for (std::size_t i = 0; i < names.size(); ++i) shot.variants.push_back({names[i], static_cast<int>(i)});
      continue;
    }
    const auto found = std::ranges::find(names, wanted);
    if (found == names.end())
      throw Failure{{Code::option_out_of_range, shot.scene.file, "--variants",
                     fmt::format("there is no \"{}\"; the file has {}", wanted, fmt::join(names, ", "))}};
    shot.variants.push_back({wanted, static_cast<int>(found - names.begin())});
  }
  if (!command.variants.empty() && shot.variants.empty())
    throw Failure{{Code::option_out_of_range, shot.scene.file, "--variants", "the file has no variants"}};
  MemoryBudget memory(shot.scene.memory_left);
  for (const std::string& path : command.fabrics) {
    auto reader = value_or_throw(FabricReader::open(path));
    shot.fabrics.push_back(value_or_throw(load_fabric(reader, memory)));
    SceneFabric& fabric = shot.scene.fabrics.emplace_back();
    fabric.name = fabric.path = path;
    shot.variants.push_back(
        {std::filesystem::path(path).filename().string(), -1, static_cast<int>(shot.fabrics.size()) - 1});
    std::string& name = shot.variants.back().name;
    name.resize(name.find('.', 1));  // "rib.fabric.exr"
  }
  shot.fabric_memory += memory.limit() - memory.unspent_bytes();
  shot.scene.memory_left = memory.unspent_bytes();
  if (!command.fabrics.empty() && has_no_fabric(shot.scene))
    throw Failure{{Code::material_missing, shot.scene.file, "--fabric",
                   "no material wears a fabric; `selvedge dress` dresses it"}};
  if (shot.variants.empty()) shot.variants.emplace_back();
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
    SceneChoice choice = command.choice;
    choice.loads_unused_fabrics = !command.variants.empty();
    const PictureOptions& picture = command.picture;
    if (!command.animation.empty())
      shot.motion = value_or_throw(Motion::load(picture.input, command.animation, choice, picture.limits));
    static_cast<LoadedScene&>(shot) = value_or_throw(
        shot.motion ? shot.motion->load_scene() : load_scene(picture.input, choice, picture.limits));
    own_lights = scene_lights(shot.scene);
    add_variants(command, shot);
    add_frames(command, shot);
  }
  std::uint64_t& memory = shot.scene.memory_left;
  shot.look = value_or_throw(look_of(command.picture, own_lights, memory));
  if (shot.look.environment)
    memory -= std::min(memory, shot.look.environment->radiance.size() * environment_bytes_per_pixel);
  shot.options.shadow_map_size = shot.look.shadow_map_size;
  if (shot.look.light.smooth_light != SmoothLight()) shot.options.smooth_light = shot.look.light.smooth_light;
  shot.options.mirrored_ambient_irradiance = static_cast<float>(command.picture.ambient_irradiance);
  shot.options.environment = shot.look.environment;
  if (command.picture.has_backdrop) shot.options.backdrop_roughness = command.picture.backdrop_roughness;
  return shot;
}

Scene worn_scene(const Shot& shot, const ShotVariant& variant) {
  if (variant.fabric < 0) {
    Scene scene = shot.scene;
    if (variant.variant >= 0) value_or_throw(wear_variant(variant.variant, scene));
    return scene;
  }
  const std::vector<int> all(shot.scene.materials.size(), variant.fabric);
  return change_fabrics(shot.scene, shot.fabrics, all);
}

void pose(const RenderCommand& command, Shot& shot, ShotFrame& frame, Scene& scene) {
  value_or_throw(shot.motion->pose(frame.time, scene));
  if (command.picture.lights.empty() && !scene.lights.empty()) shot.look.lights = scene_lights(scene);
  const std::vector<V3d> points = value_or_throw(world_points(scene));
  if (!command.file_camera.empty())
    frame.camera = value_or_throw(
        find_scene_camera(scene, command.file_camera, points, aspect_of(command), command.picture.camera));
  else
    widen_clipping_depths(box_corners(points), frame.camera);
}

}  // namespace selvedge
