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

/// The levels that the frames can need, or the forced one alone. Adds issues for levels that no file has.
std::vector<LevelRange> needed_levels(const OpenScene& open, const Shot& shot, Issues& issues) {
  const LevelOptions& levels = shot.options.levels;
  std::vector<const FabricHeader*> headers;
  std::vector<LevelRange> needed;
  for (const FabricReader& reader : open.readers) {
    headers.push_back(&reader.header());
    const int last = reader.header().levels - 1;
    const int forced = std::clamp(levels.forced - reader.header().first_level(), 0, last);
    needed.push_back(levels.forced >= 0 ? LevelRange{forced, forced} : LevelRange{last, 0});
  }
  if (levels.forced >= 0) {
    for (std::size_t i = 0; i < headers.size(); ++i) {
      if (auto issue = lacking_issue(open.scene.fabrics[i].name, *headers[i], levels.forced))
        issues.push_back(std::move(*issue));
    }
    return needed;
  }
  const int height = shot.options.height * shot.options.supersample;
  std::vector<LackingLevels> max_lacking(needed.size());
  for (const Camera& camera : shot.cameras) {
    // A swatch is rounded to whole pixels in each direction, so heights and widths give two sizes of pixels.
    const double by_width =
        shot.options.width * shot.options.supersample * camera.window_half.y / camera.window_half.x;
    std::vector<int> heights{height};
    if (std::abs(by_width - height) > 1e-6 * height)
      heights.insert(heights.end(), {std::max(1, static_cast<int>(std::floor(by_width))),
                                     static_cast<int>(std::ceil(by_width))});
    for (const int rows : heights) {
      std::vector<LackingLevels> lacking;
      const std::vector<LevelRange> asked = levels_asked(open.scene, camera, rows, levels, headers, &lacking);
      for (std::size_t i = 0; i < needed.size(); ++i) {
        needed[i] = {std::min(needed[i].first, asked[i].first), std::max(needed[i].last, asked[i].last)};
        max_lacking[i] |= lacking[i];
      }
    }
  }
  for (std::size_t i = 0; i < needed.size(); ++i) {
    if (max_lacking[i].any())
      issues.push_back(lacking_issue(open.scene.fabrics[i].name, *headers[i], max_lacking[i]));
  }
  return needed;
}

/// Reads what the frames need of the fabrics.
Subject read_subject(const std::string& file, OpenScene open, const Shot& shot) {
  Subject subject;
  subject.file = file;
  subject.levels = needed_levels(open, shot, subject.issues);
  subject.fabrics = must(read_fabrics(open, subject.levels));
  subject.bytes_read = bytes_read(open);
  subject.file_bytes = open.file_bytes;
  subject.scene = std::move(open.scene);
  subject.scene.memory_left = open.memory.left();
  return subject;
}

Shot read_swatch(const RenderCommand& command) {
  auto reader = must(FabricReader::open(command.picture.input));
  // make_swatch() uses only sizes.
  Fabric sizes{reader.header(), {}, {}};
  for (int k = 0; k < reader.header().levels; ++k) {
    FabricLevel& level = sizes.levels.emplace_back();
    level.width = level_size(reader.header().width, k);
    level.height = level_size(reader.header().height, k);
  }
  Shot shot;
  Swatch swatch;
  if (command.place) {
    const V2d period(sizes.period_mm);
    SwatchShot place = swatch_shot(*command.place, period, command.size.x, command.size.y);
    swatch = Swatch{swatch_scene(period, place), place.camera, place.width, place.height};
    shot.own_lights = std::move(place.lights);
  } else {
    swatch = must(make_swatch(sizes, command.picture.swatch));
  }
  OpenScene open{std::move(swatch.scene), {}, 0, MemoryAccount(command.picture.limits.document.memory)};
  open.scene.file = command.picture.input;
  open.scene.fabrics.emplace_back().name = command.picture.input;
  open.readers.push_back(std::move(reader));
  std::error_code unknown;
  open.file_bytes = std::filesystem::file_size(command.picture.input, unknown);
  shot.options = options_of(command);
  shot.options.width = swatch.width;
  shot.options.height = swatch.height;
  shot.options.layers = 1;
  shot.cameras = {swatch.camera};
  shot.subjects.push_back(read_subject(command.picture.input, std::move(open), shot));
  return shot;
}

/// The scene with another fabric on all materials that have one.
OpenScene dress_in(const RenderCommand& command, const std::string& path) {
  OpenScene open = must(open_scene(command.picture.input, command.choice, command.picture.limits));
  auto reader = must(FabricReader::open(path));
  // change_fabrics() uses only periods.
  std::vector<Fabric> fabrics(open.readers.size() + 1);
  for (std::size_t i = 0; i < open.readers.size(); ++i)
    fabrics[i].period_mm = open.readers[i].header().period_mm;
  fabrics.back().period_mm = reader.header().period_mm;
  std::vector<int> choice = fabrics_of(open.scene);
  for (int& fabric : choice) {
    if (fabric >= 0) fabric = static_cast<int>(fabrics.size()) - 1;
  }
  open.scene = change_fabrics(open.scene, fabrics, choice);
  for (SceneMaterial& material : open.scene.materials) {
    if (material.fabric) material.fabric->fabric = 0;
  }
  SceneFabric source;
  source.name = source.path = path;
  open.scene.fabrics = {source};
  open.readers.clear();
  open.readers.push_back(std::move(reader));
  std::error_code unknown;
  open.file_bytes = std::filesystem::file_size(path, unknown);
  return open;
}

Result<Shot> read_scene_shot(const RenderCommand& command) {
  auto open = must(open_scene(command.picture.input, command.choice, command.picture.limits));
  const auto points = must(world_points(open.scene));
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
        must(camera_of(open.scene, command.camera_of_file, points, aspect, command.picture.camera))};
  }
  shot.subjects.push_back(read_subject(command.picture.input, std::move(open), shot));
  shot.own_lights = lights_of(shot.subjects.front().scene);
  if (command.compare.empty()) return shot;
  OpenScene other = has_ending(command.compare, ".exr")
                        ? dress_in(command, command.compare)
                        : must(open_scene(command.compare, {}, command.picture.limits));
  shot.subjects.push_back(read_subject(command.compare, std::move(other), shot));
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
