// render: draws a scene, or a swatch of a fabric, to PNG and EXR files.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/selvedge-view/commands.h"
#include "apps/selvedge-view/shot.h"
#include "format/base/atomic_file.h"
#include "format/base/option_text.h"
#include "format/base/parallel.h"
#include "viewer/orbit.h"
#include "viewer/renderer.h"

namespace selvedge {
namespace {

/// Maximum number of files of one run, which are all open until the last is written.
constexpr std::size_t max_files = 720;

/// Writes a frame to `path` in the format of the name `like`.
Result<void> write(const DisplayOptions& display, const Frame& frame, const std::string& like,
                   const std::string& path) {
  if (has_ending(like, ".exr")) return write_exr(path, to_linear_image(frame));
  return write_png(path, to_display_image(frame, display));
}

/// The files of all frames, opened before the work, so that an unwritable folder is reported first.
std::vector<AtomicFile> open_files(const RenderCommand& command, std::size_t frames) {
  std::vector<AtomicFile> files;
  for (std::size_t i = 0; i < frames; ++i) {
    for (const std::string& path : command.outputs)
      files.push_back(value_or_throw(
          AtomicFile::create(command.turntable > 0 ? frame_path(path, static_cast<int>(i)) : path)));
  }
  return files;
}

struct Drawn {
  RenderStats stats;        ///< sums over the frames
  AccuratePicture picture;  ///< the first frame; without a time the others have its supersampling
  std::vector<std::string> outputs;
  float brightest = 0;  ///< sRGB value of the frames, over black
  double write_seconds = 0;
};

/// The largest sRGB value of a frame over black.
float brightest(const Frame& frame, DisplayOptions display) {
  display.background = V3f(0, 0, 0);
  const Image image = to_display_image(frame, display);
  return linear_to_srgb(std::ranges::max(image.pixels));
}

/// Draws all frames into temporary files.
Drawn draw(const Shot& shot, PictureGoal goal, const std::vector<AtomicFile>& files) {
  const Stopwatch preparing;
  const std::unique_ptr<Renderer> renderer =
      value_or_throw(Renderer::create(shot.scene, shot.fabrics, shot.options));
  if (goal.seconds) *goal.seconds -= preparing.seconds();
  const std::size_t files_per_frame = files.size() / shot.cameras.size();
  RenderOptions options = shot.options;
  Frame frame;
  Drawn drawn;
  auto file = files.begin();
  for (const Camera& camera : shot.cameras) {
    options.lights = shot.look.all_lights(camera);
    RenderStats stats;
    const bool is_first = &camera == shot.cameras.data();
    if (is_first || goal.seconds) {
      const auto picture =
          value_or_throw(draw_for_goal(*renderer, goal, options, camera, options, frame, stats));
      if (is_first) drawn.picture = picture;
      if (!goal.seconds) options.cells.samples_per_pixel_side = image_samples(picture.supersample);
    } else {
      value_or_throw(renderer->draw(camera, options, frame, stats));
    }
    accumulate(stats, drawn.stats);
    drawn.brightest = std::max(drawn.brightest, brightest(frame, shot.look.display));
    Stopwatch watch;
    for (std::size_t i = 0; i < files_per_frame; ++i, ++file) {
      drawn.outputs.push_back(file->path());
      value_or_throw(
          write(shot.look.display, frame, file->path(), file->temporary_path()).map_error([&](Error error) {
            error.file = file->path();
            return error;
          }));
    }
    watch.add_lap(drawn.write_seconds);
  }
  return drawn;
}

constexpr float black = 2.0F / 255;

/// Whether the first frame, drawn small and without the fabrics, is black.
bool is_black_undressed(const Shot& shot) {
  Scene scene = shot.scene;
  for (SceneMaterial& material : scene.materials) material.fabric.reset();
  RenderOptions options = shot.options;
  options.width = 64;
  options.height = std::max(1, 64 * shot.options.height / shot.options.width);
  options.supersample = 1;
  options.lights = shot.look.all_lights(shot.cameras.front());
  const Frame frame = value_or_throw(render(scene, {}, shot.cameras.front(), options));
  return brightest(frame, shot.look.display) < black;
}

/// Why a picture shows next to nothing, in a line; or empty.
std::string emptiness(const RenderCommand& command, const Shot& shot, const Drawn& drawn) {
  const RenderStats& stats = drawn.stats;
  if (stats.covered_pixels == 0)
    return "no pixel shows the scene: it is out of the camera's sight, or all clear";
  const bool dressed = std::ranges::any_of(shot.scene.materials,
                                           [](const auto& material) { return material.fabric.has_value(); });
  if (dressed && stats.cloth_pixels == 0) return "no pixel shows cloth";
  if (drawn.brightest < black) {
    return dressed && !is_black_undressed(shot)
               ? "the picture is black; without its fabrics the scene is not"
               : "the picture is black: the light, the exposure or all colours are";
  }
  const double fraction = static_cast<double>(stats.cloth_pixels) / static_cast<double>(stats.covered_pixels);
  const PictureOptions& picture = command.picture;
  const bool is_default = !command.has_view_angles && command.file_camera.empty() &&
                          picture.camera.zoom == 1 && !picture.camera.distance && !picture.camera.look_at;
  if (dressed && is_default && fraction < 0.01)
    return fmt::format("cloth shows in {:.2g} % of the pixels that show the scene", 100 * fraction);
  return "";
}

Json to_json(const RenderStats& stats) {
  Json json;
  for (const auto& [name, seconds] : render_seconds) json[name] = stats.*seconds;
  return json;
}

/// dB of the least accurate yarn against its stitch (spec/fabric.md); infinite where nothing is known.
double yarn_accuracy(const Shot& shot) {
  double least = HUGE_VAL;
  if (shot.options.path == RenderPath::paper || shot.options.levels.forced_level >= 0) return least;
  for (const Fabric& fabric : shot.fabrics) {
    if (!fabric.levels.front().yarns()) continue;
    const Json accuracy = Json::parse(fabric.accuracy);
    if (accuracy.contains("yarn") && accuracy["yarn"].is_number())
      least = std::min(least, accuracy["yarn"].get<double>());
  }
  return least;
}

/// JSON has no infinite numbers.
Json known(double decibels) { return std::isfinite(decibels) ? Json(decibels) : Json(nullptr); }

Json to_json(const RenderCommand& command, const Shot& shot, const Drawn& drawn) {
  const RenderStats& stats = drawn.stats;
  const double picture = drawn.picture.accuracy_db > 0 ? drawn.picture.accuracy_db : HUGE_VAL;
  const double yarn = yarn_accuracy(shot);
  const double both = -10 * std::log10(std::pow(10, -picture / 10) + std::pow(10, -yarn / 10));
  return {{"input", command.picture.input},
          {"outputs", drawn.outputs},
          {"width", shot.options.width},
          {"height", shot.options.height},
          {"frames", shot.cameras.size()},
          {"supersample", drawn.picture.supersample},
          {"magnified", drawn.picture.magnification},
          {"accuracy", known(picture)},
          {"yarnAccuracy", known(yarn)},
          {"bothAccuracies", known(std::isfinite(picture) && std::isfinite(yarn) ? both : HUGE_VAL)},
          {"path", path_names[static_cast<std::size_t>(shot.options.path)]},
          {"threads", thread_count()},
          {"fabrics", shot.fabrics.size()},
          {"fabricMemory", shot.fabric_memory},
          {"triangles", stats.triangles},
          {"layers", stats.layers},
          {"coveredPixels", stats.covered_pixels},
          {"evaluatedPixels", stats.evaluated_pixels},
          {"imageBytes", stats.peak_image_bytes},
          {"seconds", to_json(stats)}};
}

Result<int> run(const RenderCommand& command) {
  limit_mesa_threads(command.common.threads);
  if (command.outputs.size() * static_cast<std::size_t>(std::max(command.turntable, 1)) > max_files) {
    return fail(Code::option_out_of_range, "", "--turntable",
                fmt::format("makes more than {} files at once", max_files));
  }
  const Stopwatch watch;
  // Reported before a large garment is read.
  if (command.turntable == 0) value_or_throw(check_writable(command.outputs));
  const Shot shot = read_shot(command);
  const double read = watch.seconds();
  std::vector<AtomicFile> files = open_files(command, shot.cameras.size());
  const Drawn drawn = draw(shot, command.goal, files);
  value_or_throw(commit_all(std::move(files)));
  Json all = to_json(command, shot, drawn);
  std::vector<std::string> remarks = shot.scene.remarks;
  remarks.insert(remarks.end(), drawn.stats.remarks.begin(), drawn.stats.remarks.end());
  if (drawn.picture.magnification > 1)
    remarks.push_back(
        fmt::format("--seconds allows one ray for {0} x {0} pixels, magnified", drawn.picture.magnification));
  if (std::string empty = emptiness(command, shot, drawn); !empty.empty())
    remarks.push_back(std::move(empty));
  all["remarks"] = remarks;
  const auto environment =
      shot.look.environment ? shot.look.environment->remarks : std::vector<std::string>();
  for (const std::string& remark : environment)
    all["remarks"].push_back(shot.look.environment_name + ": " + remark);
  report_remarks(command.common, "note", remarks);
  report_remarks(command.common, shot.look.environment_name, environment);
  all["seconds"]["read"] = read;
  all["seconds"]["write"] = drawn.write_seconds;
  all["seconds"]["total"] = watch.seconds();
  report(command.common, "render", all, "");
  return 0;
}

}  // namespace

void limit_mesa_threads(int threads) {
  if (threads > 0) setenv("LP_NUM_THREADS", fmt::format("{}", threads).c_str(), 0);
}

void add_render_verb(Program& program) {
  program.add<RenderCommand>(
      {"render", "Draw a scene, or a swatch of a fabric, into PNG and EXR files",
       "selvedge-view render sweater.glb -o sweater.png --size 1280x960 --azimuth 30\n"
       "selvedge-view render knit.fabric.exr -o knit.exr --repeats 4x4 --light 0,0.5,1 --view 0,-1,1",
       "PNG: radiance * exposure, tone curve, over the background, clipped, sRGB.\n"
       "EXR: linear radiance * opacity, and opacity.\n"
       "Tone curves of an exposed colour c: neutral is Khronos PBR Neutral (2024), which keeps saturated "
       "colours;\n"
       "agx is AgX (Sobotka 2022) as in Blender and three.js, where bright colours turn white.\n"},
      declare_render, run);
}

}  // namespace selvedge
