#include "viewer/commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "format/atomic_file.h"
#include "format/fabric_exr.h"
#include "format/gltf_scene.h"
#include "format/image.h"
#include "format/option_text.h"
#include "format/parallel.h"
#include "format/printable.h"
#include "viewer/geometry.h"

namespace selvedge {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

int report(const Error& error) {
  fmt::print(stderr, "selvedge-view: {}\n", to_line(error));
  return 1;
}

std::vector<Light> lights_of(const RenderCommand& command, const Scene& scene, const Camera& camera) {
  if (command.lights.empty() && !scene.lights.empty()) return lights_of(scene);
  if (command.lights.empty()) return default_lights(camera);
  std::vector<Light> lights;
  for (const LightOption& option : command.lights) {
    const V3d direction(option.x, option.y, option.z);
    const V3d world = command.lights_in_camera_frame ? from_camera_frame(camera, direction) : direction;
    Light light;
    light.direction = world.normalized();
    light.irradiance = V3f(option.w);
    lights.push_back(light);
  }
  return lights;
}

/// The fabrics of a scene. Materials whose fabric file is not there are left to their core parameters, with a
/// remark; what is there and broken is an error.
Result<std::vector<Fabric>> read_fabrics(Scene& scene) {
  std::vector<Fabric> fabrics;
  std::vector<SceneFabric> present;
  std::vector<int> numbers;  // old -> new
  for (SceneFabric& source : scene.fabrics) {
    Result<Fabric> fabric =
        source.path.empty() ? read_fabric(source.bytes, source.name) : read_fabric(source.path);
    if (!fabric && fabric.error().code != Code::file_missing) return tl::unexpected(fabric.error());
    numbers.push_back(fabric ? static_cast<int>(fabrics.size()) : -1);
    if (fabric) {
      fabrics.push_back(std::move(*fabric));
      present.push_back(std::move(source));
    } else {
      scene.remarks.push_back(to_line(fabric.error()) + "; the fallback is drawn");
    }
  }
  scene.fabrics = std::move(present);
  for (SceneMaterial& material : scene.materials) {
    if (!material.fabric) continue;
    int& fabric = material.fabric->fabric;
    fabric = numbers[static_cast<std::size_t>(fabric)];
    if (fabric < 0) material.fabric.reset();
  }
  return fabrics;
}

/// What is drawn, and how.
struct Shot {
  Scene scene;
  std::vector<Fabric> fabrics;
  Camera camera;
  RenderOptions options;
};

Result<Shot> read_swatch(const RenderCommand& command) {
  Result<Fabric> fabric = read_fabric(command.input);
  if (!fabric) return tl::unexpected(fabric.error());
  Result<Swatch> swatch = make_swatch(*fabric, command.swatch);
  if (!swatch) return tl::unexpected(swatch.error());
  Shot shot{std::move(swatch->scene), {}, swatch->camera, command.render};
  shot.scene.file = command.input;
  shot.fabrics.push_back(std::move(*fabric));
  shot.options.width = swatch->width;
  shot.options.height = swatch->height;
  shot.options.layers = 1;
  return shot;
}

Result<Shot> read_scene_shot(const RenderCommand& command) {
  Result<Scene> scene = read_scene(command.input, {}, command.choice);
  if (!scene) return tl::unexpected(scene.error());
  Result<std::vector<Fabric>> fabrics = read_fabrics(*scene);
  if (!fabrics) return tl::unexpected(fabrics.error());
  const Result<std::vector<V3d>> points = world_points(*scene);
  if (!points) return tl::unexpected(points.error());
  const double aspect = static_cast<double>(command.render.width) / command.render.height;
  const Result<Camera> camera = command.camera_of_file.empty() ? make_camera(*points, aspect, command.camera)
                                                               : camera_of(*scene, command.camera_of_file,
                                                                           *points, aspect, command.camera);
  if (!camera) return tl::unexpected(camera.error());
  return Shot{std::move(*scene), std::move(*fabrics), *camera, command.render};
}

Result<void> write(const RenderCommand& command, const Frame& frame, const std::string& path) {
  if (has_ending(path, ".exr")) return write_exr(path, to_linear_image(frame));
  return write_png(path, to_display_image(frame, static_cast<float>(command.exposure), command.background));
}

Json to_json(const RenderCommand& command, const Shot& shot, const RenderStats& stats) {
  return {{"program", "selvedge-view"},
          {"version", SELVEDGE_VERSION},
          {"report", 1},
          {"verb", "render"},
          {"input", command.input},
          {"outputs", command.outputs},
          {"width", shot.options.width},
          {"height", shot.options.height},
          {"supersample", shot.options.supersample},
          {"path", shot.options.path == RenderPath::shader ? "shader" : "hybrid"},
          {"threads", thread_count()},
          {"fabrics", shot.fabrics.size()},
          {"triangles", stats.triangles},
          {"layers", stats.layers},
          {"coveredPixels", stats.covered_pixels},
          {"evaluatedPixels", stats.evaluated_pixels},
          {"remarks", stats.remarks},
          {"seconds",
           {{"prepare", stats.prepare},
            {"project", stats.project},
            {"geometry", stats.geometry},
            {"readBack", stats.read_back},
            {"evaluation", stats.evaluation},
            {"filter", stats.filter},
            {"shaderGeometry", 1e-9 * static_cast<double>(stats.shader.geometry)},
            {"shaderShading", 1e-9 * static_cast<double>(stats.shader.shading)}}}};
}

}  // namespace

int run(const RenderCommand& command) {
  for (const std::string& path : command.outputs) {
    // Said before the work, and before another picture is written.
    if (const auto writable = AtomicFile::create(path); !writable) return report(writable.error());
  }
  set_threads(command.threads);
  // Mesa's rasteriser has threads of its own; whoever set their number already knows better.
  if (command.threads > 0) setenv("LP_NUM_THREADS", fmt::format("{}", command.threads).c_str(), 0);
  const Clock::time_point start = Clock::now();
  Result<Shot> shot = has_ending(command.input, ".exr") ? read_swatch(command) : read_scene_shot(command);
  if (!shot) return report(shot.error());
  shot->options.lights = lights_of(command, shot->scene, shot->camera);
  const double read = seconds_since(start);

  RenderStats stats;
  const Result<Frame> frame = render(shot->scene, shot->fabrics, shot->camera, shot->options, &stats);
  if (!frame) return report(frame.error());

  const Clock::time_point write_start = Clock::now();
  for (const std::string& path : command.outputs) {
    if (const auto good = write(command, *frame, path); !good) return report(good.error());
  }
  if (!command.quiet) {
    for (const std::vector<std::string>& remarks : {shot->scene.remarks, stats.remarks}) {
      for (const std::string& remark : remarks) {
        fmt::print(stderr, "selvedge-view: note: {}\n", printable(remark));
      }
    }
  }
  if (command.json) {
    Json all = to_json(command, *shot, stats);
    all["seconds"]["read"] = read;
    all["seconds"]["write"] = seconds_since(write_start);
    all["seconds"]["total"] = seconds_since(start);
    fmt::print("{}\n", all.dump(2, ' ', false, Json::error_handler_t::replace));
  }
  return 0;
}

int run(const CompareCommand& command) {
  // As stored: differences are then told in steps of the picture that people see.
  const Result<Image> first = read_image(command.first, Transfer::keep);
  if (!first) return report(first.error());
  const Result<Image> second = read_image(command.second, Transfer::keep);
  if (!second) return report(second.error());
  const Result<ImageDifference> difference = compare_images(*first, *second);
  if (!difference) {
    Error error = difference.error();
    if (error.file.empty()) error.file = command.second;
    return report(error);
  }
  const ImageDifference& d = *difference;
  if (command.json) {
    const Json all = {{"program", "selvedge-view"},
                      {"version", SELVEDGE_VERSION},
                      {"report", 1},
                      {"verb", "compare"},
                      {"maxAbsolute", std::isfinite(d.max_absolute) ? Json(d.max_absolute) : Json(nullptr)},
                      {"x", d.x},
                      {"y", d.y},
                      {"channel", d.channel},
                      {"rmse", std::isfinite(d.rmse) ? Json(d.rmse) : Json(nullptr)},
                      {"psnr", std::isfinite(d.psnr) ? Json(d.psnr) : Json(nullptr)}};
    fmt::print("{}\n", all.dump(2));
  } else {
    fmt::print("max {:.6g} at ({}, {}) channel {}, RMSE {:.6g}, PSNR {:.2f} dB\n", d.max_absolute, d.x, d.y,
               d.channel, d.rmse, d.psnr);
  }
  if (command.max && !(d.max_absolute <= *command.max)) {
    return report({Code::image_mismatch, command.second, fmt::format("pixel ({}, {})", d.x, d.y),
                   fmt::format("differs from {} by {:.6g}, more than {:.6g}", command.first, d.max_absolute,
                               *command.max)});
  }
  return 0;
}

}  // namespace selvedge
