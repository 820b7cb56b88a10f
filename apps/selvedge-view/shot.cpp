#include "apps/selvedge-view/shot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "format/base/option_text.h"
#include "viewer/scene/change_fabrics.h"
#include "viewer/scene/surfaces.h"
#include "viewer/turntable.h"

namespace selvedge {
namespace {

RenderOptions options_of(const RenderCommand& command) {
  RenderOptions options = command.render;
  options.width = command.size.x;
  options.height = command.size.y;
  options.levels = command.picture.levels;
  options.layers = command.picture.layers;
  return options;
}

Subject subject_of(const std::string& file, LoadedScene loaded) {
  return {file, std::move(loaded.scene), std::move(loaded.fabrics), loaded.file_bytes};
}

Shot read_swatch(const RenderCommand& command) {
  auto reader = must(FabricReader::open(command.picture.input));
  MemoryAccount memory(command.picture.limits.document.memory);
  LoadedScene loaded;
  loaded.fabrics.push_back(must(load_fabric(reader, memory)));
  const Fabric& fabric = loaded.fabrics.front();
  Shot shot;
  Swatch swatch;
  if (command.place) {
    const V2d period(fabric.period_mm);
    SwatchShot place = swatch_shot(*command.place, period, command.size.x, command.size.y);
    swatch = Swatch{swatch_scene(period, place), place.camera, place.width, place.height};
    shot.own_lights = std::move(place.lights);
  } else {
    swatch = must(make_swatch(fabric, command.picture.swatch));
  }
  loaded.scene = std::move(swatch.scene);
  loaded.scene.file = command.picture.input;
  loaded.scene.fabrics.emplace_back().name = command.picture.input;
  loaded.scene.memory_left = memory.left();
  std::error_code unknown;
  loaded.file_bytes = std::filesystem::file_size(command.picture.input, unknown);
  shot.options = options_of(command);
  shot.options.width = swatch.width;
  shot.options.height = swatch.height;
  shot.options.layers = 1;
  shot.cameras = {swatch.camera};
  shot.subjects.push_back(subject_of(command.picture.input, std::move(loaded)));
  return shot;
}

/// The scene with another fabric on all materials that have one.
LoadedScene dress_in(const RenderCommand& command, const std::string& path) {
  LoadedScene loaded = must(load_scene(command.picture.input, command.choice, command.picture.limits));
  loaded.fabrics.push_back(must(read_fabric(path, {.memory = loaded.scene.memory_left})));
  const int last = static_cast<int>(loaded.fabrics.size()) - 1;
  std::vector<int> choice = fabrics_of(loaded.scene);
  for (int& fabric : choice) fabric = fabric < 0 ? fabric : last;
  loaded.scene = change_fabrics(loaded.scene, loaded.fabrics, choice);
  for (SceneMaterial& material : loaded.scene.materials) {
    if (material.fabric) material.fabric->fabric = 0;
  }
  loaded.fabrics = {std::move(loaded.fabrics.back())};
  SceneFabric source;
  source.name = source.path = path;
  loaded.scene.fabrics = {source};
  std::error_code unknown;
  loaded.file_bytes = std::filesystem::file_size(path, unknown);
  return loaded;
}

Result<Shot> read_scene_shot(const RenderCommand& command) {
  auto loaded = must(load_scene(command.picture.input, command.choice, command.picture.limits));
  const auto points = must(world_points(loaded.scene));
  Shot shot;
  shot.options = options_of(command);
  const double aspect = static_cast<double>(command.size.x) / command.size.y;
  if (command.camera_of_file.empty()) {
    shot.cameras = must(turntable(points, aspect, command.picture.camera, command.turntable));
  } else if (command.turntable > 0) {
    return fail(Code::option_out_of_range, "", "--camera",
                "a camera of the file does not turn: no --turntable");
  } else {
    shot.cameras = {
        must(camera_of(loaded.scene, command.camera_of_file, points, aspect, command.picture.camera))};
  }
  shot.subjects.push_back(subject_of(command.picture.input, std::move(loaded)));
  shot.own_lights = lights_of(shot.subjects.front().scene);
  if (command.compare.empty()) return shot;
  LoadedScene other = has_ending(command.compare, ".exr")
                          ? dress_in(command, command.compare)
                          : must(load_scene(command.compare, {}, command.picture.limits));
  shot.subjects.push_back(subject_of(command.compare, std::move(other)));
  return shot;
}

}  // namespace

Shot read_shot(const RenderCommand& command) {
  Shot shot =
      has_ending(command.picture.input, ".exr") ? read_swatch(command) : must(read_scene_shot(command));
  std::uint64_t memory = command.picture.limits.document.memory;
  for (const Subject& subject : shot.subjects) memory = std::min(memory, subject.scene.memory_left);
  shot.look = must(look_of(command.picture, shot.own_lights, memory));
  if (shot.look.environment) {
    const std::uint64_t taken = shot.look.environment->radiance.size() * environment_price;
    for (Subject& subject : shot.subjects)
      subject.scene.memory_left -= std::min(subject.scene.memory_left, taken);
  }
  shot.options.shadows = shot.look.shadows;
  if (shot.look.has_around()) shot.options.around = shot.look.light.rest;
  shot.options.ambient = static_cast<float>(command.picture.ambient);
  shot.options.environment = shot.look.environment;
  if (command.picture.backdrop) shot.options.backdrop = command.picture.backdrop_blur;
  return shot;
}

}  // namespace selvedge
