#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "apps/common/distinct_paths.h"
#include "apps/selvedge-view/commands.h"
#include "format/base/atomic_file.h"
#include "format/base/option_text.h"
#include "format/base/parallel.h"
#include "format/base/printable.h"
#include "format/scene/level_bounds.h"
#include "viewer/load.h"
#include "viewer/paper/limits.h"
#include "viewer/renderer.h"
#include "viewer/scene/change_fabrics.h"
#include "viewer/scene/surfaces.h"
#include "viewer/turntable.h"

namespace selvedge {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

/// Files that one run may make: they are all open until the last is there.
constexpr std::size_t max_files = 720;
/// Pixels between two pictures side by side.
constexpr int divider_width = 4;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// What is drawn: a scene and its fabrics.
struct Subject {
  std::string file;
  Scene scene;
  std::vector<Fabric> fabrics;
  std::vector<LevelRange> levels;  ///< of the fabrics, that were read
  std::uint64_t bytes_read = 0;    ///< of the fabric files
  std::uint64_t file_bytes = 0;
  Issues issues;  ///< warnings
};

/// One or two subjects, and how they are drawn.
struct Shot {
  std::vector<Subject> subjects;
  std::vector<Camera> cameras;  ///< one for each frame
  RenderOptions options;
  std::vector<Light> lights;  ///< of a swatch that has its own
};

std::vector<Light> lights_for(const RenderCommand& command, const Scene& scene, const Camera& camera) {
  if (command.lights.empty() && !scene.lights.empty()) return lights_of(scene);
  if (command.lights.empty()) return default_lights(camera);
  return command.lights_in_camera_frame ? from_camera_frame(camera, command.lights) : command.lights;
}

RenderOptions options_of(const RenderCommand& command) {
  RenderOptions options = command.render;
  // A level by itself is looked at for its texels.
  if (options.levels.forced >= 0) options.levels.linear = false;
  return options;
}

/// The levels that the frames can ask for; a forced one alone. Issues: what they ask for and no file has.
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
    // A swatch is rounded to whole pixels: they are as high as those of one height, as wide as those of
    // another.
    const double by_width =
        shot.options.width * shot.options.supersample * camera.window_half.y / camera.window_half.x;
    std::vector<int> heights{height};
    if (std::abs(by_width - height) > 1e-6 * height)
      heights.insert(heights.end(), {std::max(1, static_cast<int>(std::floor(by_width))),
                                     static_cast<int>(std::ceil(by_width))});
    for (const int of : heights) {
      std::vector<LackingLevels> lacking;
      const std::vector<LevelRange> asked = levels_asked(open.scene, camera, of, levels, headers, &lacking);
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
  if (shot.options.path != RenderPath::paper) return needed;
  for (std::size_t i = 0; i < needed.size(); ++i) {
    needed[i].first = finest_for_paper(needed[i].first);
    needed[i].last = coarsest_for_paper(needed[i].last, headers[i]->levels);
  }
  return needed;
}

/// Reads what the frames need of the fabrics.
Result<Subject> read_subject(const std::string& file, OpenScene open, const Shot& shot) {
  Subject subject;
  subject.file = file;
  subject.levels = needed_levels(open, shot, subject.issues);
  Result<std::vector<Fabric>> fabrics = read_fabrics(open, subject.levels);
  if (!fabrics) return tl::unexpected(fabrics.error());
  subject.fabrics = std::move(*fabrics);
  subject.bytes_read = bytes_read(open);
  subject.file_bytes = open.file_bytes;
  subject.scene = std::move(open.scene);
  return subject;
}

Result<Shot> read_swatch(const RenderCommand& command) {
  Result<FabricReader> reader = FabricReader::open(command.input);
  if (!reader) return tl::unexpected(reader.error());
  // The sizes are all that a swatch is made of.
  Fabric sizes{reader->header(), {}};
  for (int k = 0; k < reader->header().levels; ++k) {
    FabricLevel& level = sizes.levels.emplace_back();
    level.width = level_size(reader->header().width, k);
    level.height = level_size(reader->header().height, k);
  }
  Shot shot;
  Result<Swatch> swatch = Swatch();
  if (command.place) {
    const V2d period(sizes.period_mm);
    SwatchShot of = swatch_shot(*command.place, period, command.render.width, command.render.height);
    swatch = Swatch{swatch_scene(period, of), of.camera, of.width, of.height};
    shot.lights = std::move(of.lights);
  } else {
    swatch = make_swatch(sizes, command.swatch);
  }
  if (!swatch) return tl::unexpected(swatch.error());
  OpenScene open{std::move(swatch->scene), {}, 0};
  open.scene.file = command.input;
  open.scene.fabrics.emplace_back().name = command.input;
  open.readers.push_back(std::move(*reader));
  std::error_code unknown;
  open.file_bytes = std::filesystem::file_size(command.input, unknown);
  shot.options = options_of(command);
  shot.options.width = swatch->width;
  shot.options.height = swatch->height;
  shot.options.layers = 1;
  shot.cameras = {swatch->camera};
  Result<Subject> subject = read_subject(command.input, std::move(open), shot);
  if (!subject) return tl::unexpected(subject.error());
  shot.subjects.push_back(std::move(*subject));
  return shot;
}

/// The same scene with another fabric on all that has one.
Result<OpenScene> dress_in(const RenderCommand& command, const std::string& path) {
  Result<OpenScene> open = open_scene(command.input, command.choice);
  if (!open) return open;
  Result<FabricReader> reader = FabricReader::open(path);
  if (!reader) return tl::unexpected(reader.error());
  // Their periods are all that the change looks at.
  std::vector<Fabric> fabrics(open->readers.size() + 1);
  for (std::size_t i = 0; i < open->readers.size(); ++i)
    fabrics[i].period_mm = open->readers[i].header().period_mm;
  fabrics.back().period_mm = reader->header().period_mm;
  std::vector<int> choice = fabrics_of(open->scene);
  for (int& fabric : choice) {
    if (fabric >= 0) fabric = static_cast<int>(fabrics.size()) - 1;
  }
  open->scene = change_fabrics(open->scene, fabrics, choice);
  for (SceneMaterial& material : open->scene.materials) {
    if (material.fabric) material.fabric->fabric = 0;
  }
  SceneFabric source;
  source.name = source.path = path;
  open->scene.fabrics = {source};
  open->readers.clear();
  open->readers.push_back(std::move(*reader));
  std::error_code unknown;
  open->file_bytes = std::filesystem::file_size(path, unknown);
  return open;
}

Result<Shot> read_scene_shot(const RenderCommand& command) {
  Result<OpenScene> open = open_scene(command.input, command.choice);
  if (!open) return tl::unexpected(open.error());
  const Result<std::vector<V3d>> points = world_points(open->scene);
  if (!points) return tl::unexpected(points.error());
  Shot shot;
  shot.options = options_of(command);
  const double aspect = static_cast<double>(command.render.width) / command.render.height;
  if (command.camera_of_file.empty()) {
    Result<std::vector<Camera>> cameras = turntable(*points, aspect, command.camera, command.turntable);
    if (!cameras) return tl::unexpected(cameras.error());
    shot.cameras = std::move(*cameras);
  } else if (command.turntable > 0) {
    return fail(Code::option_out_of_range, "", "--camera",
                "a camera of the file does not turn: no --turntable");
  } else {
    Result<Camera> camera = camera_of(open->scene, command.camera_of_file, *points, aspect, command.camera);
    if (!camera) return tl::unexpected(camera.error());
    shot.cameras = {*camera};
  }
  Result<Subject> subject = read_subject(command.input, std::move(*open), shot);
  if (!subject) return tl::unexpected(subject.error());
  shot.subjects.push_back(std::move(*subject));
  if (command.compare.empty()) return shot;
  Result<OpenScene> other =
      has_ending(command.compare, ".exr") ? dress_in(command, command.compare) : open_scene(command.compare);
  if (!other) return tl::unexpected(other.error());
  Result<Subject> second = read_subject(command.compare, std::move(*other), shot);
  if (!second) return tl::unexpected(second.error());
  shot.subjects.push_back(std::move(*second));
  return shot;
}

/// Two frames of one size with an opaque black line between them.
Frame side_by_side(const Frame& left, const Frame& right) {
  Frame both{left.width + divider_width + right.width, left.height, {}};
  both.pixels.reserve(static_cast<std::size_t>(both.width) * static_cast<std::size_t>(both.height));
  for (int y = 0; y < left.height; ++y) {
    const auto add_row = [&](const Frame& from) {
      const auto row = from.pixels.begin() + static_cast<std::ptrdiff_t>(y) * from.width;
      both.pixels.insert(both.pixels.end(), row, row + from.width);
    };
    add_row(left);
    both.pixels.insert(both.pixels.end(), divider_width, V4f(0, 0, 0, 1));
    add_row(right);
  }
  return both;
}

Result<void> write(const RenderCommand& command, const Frame& frame, const std::string& like,
                   const std::string& path) {
  if (has_ending(like, ".exr")) return write_exr(path, to_linear_image(frame));
  return write_png(path, to_display_image(frame, command.display));
}

void add(const RenderStats& one, RenderStats& sum) {
  sum.prepare = one.prepare;
  sum.project += one.project;
  sum.shadows += one.shadows;
  sum.geometry += one.geometry;
  sum.read_back += one.read_back;
  sum.evaluation += one.evaluation;
  sum.filter += one.filter;
  sum.shader.geometry += one.shader.geometry;
  sum.shader.shading += one.shader.shading;
  sum.triangles = one.triangles;
  sum.covered_pixels += one.covered_pixels;
  sum.evaluated_pixels += one.evaluated_pixels;
  sum.layers = std::max(sum.layers, one.layers);
  sum.remarks = one.remarks;
}

/// All frames, into files that are not yet in their places.
class Series {
 public:
  Series(const RenderCommand& command, const Shot& shot) : command_(command), shot_(shot) {}

  /// So that an unwritable folder is found before the work begins.
  Result<void> open_files() {
    for (std::size_t frame = 0; frame < shot_.cameras.size(); ++frame) {
      for (const std::string& path : command_.outputs) {
        Result<AtomicFile> file =
            AtomicFile::create(command_.turntable > 0 ? frame_path(path, static_cast<int>(frame)) : path);
        if (!file) return tl::unexpected(file.error());
        files_.push_back(std::move(*file));
      }
    }
    return {};
  }

  Result<void> draw() {
    std::vector<std::unique_ptr<Renderer>> renderers;
    for (const Subject& subject : shot_.subjects) {
      Result<std::unique_ptr<Renderer>> renderer =
          Renderer::create(subject.scene, subject.fabrics, shot_.options);
      if (!renderer) return tl::unexpected(renderer.error());
      renderers.push_back(std::move(*renderer));
    }
    stats_.resize(renderers.size());
    std::array<Frame, 2> frames;
    std::size_t file = 0;
    for (const Camera& camera : shot_.cameras) {
      RenderOptions look = shot_.options;
      look.lights = command_.lights.empty() && !shot_.lights.empty()
                        ? shot_.lights
                        : lights_for(command_, shot_.subjects.front().scene, camera);
      for (std::size_t i = 0; i < renderers.size(); ++i) {
        RenderStats stats;
        if (auto good = renderers[i]->draw(camera, look, frames[i], stats); !good) return good;
        add(stats, stats_[i]);
      }
      const Clock::time_point start = Clock::now();
      if (renderers.size() > 1) frames[0] = side_by_side(frames[0], frames[1]);
      for (const std::string& path : command_.outputs) {
        if (auto good = write(command_, frames[0], path, files_[file].temporary()); !good) {
          Error error = good.error();
          error.file = files_[file].path();
          return tl::unexpected(error);
        }
        ++file;
      }
      write_seconds_ += seconds_since(start);
    }
    return {};
  }

  /// Moves all of them to their places.
  Result<void> commit() {
    for (AtomicFile& file : files_) {
      if (auto good = file.commit(); !good) return good;
    }
    return {};
  }

  const std::vector<RenderStats>& stats() const { return stats_; }
  double write_seconds() const { return write_seconds_; }

 private:
  const RenderCommand& command_;
  const Shot& shot_;
  std::vector<AtomicFile> files_;
  std::vector<RenderStats> stats_;  ///< of the subjects, over all frames
  double write_seconds_ = 0;
};

Json to_json(const RenderStats& stats) {
  return {{"prepare", stats.prepare},
          {"project", stats.project},
          {"shadows", stats.shadows},
          {"geometry", stats.geometry},
          {"readBack", stats.read_back},
          {"evaluation", stats.evaluation},
          {"filter", stats.filter},
          {"shaderGeometry", 1e-9 * static_cast<double>(stats.shader.geometry)},
          {"shaderShading", 1e-9 * static_cast<double>(stats.shader.shading)}};
}

Json lines_of(const Issues& issues) {
  Json lines = Json::array();
  for (const Error& issue : issues) lines.push_back(to_line(issue));
  return lines;
}

Json to_json(const Subject& subject, const RenderStats& stats) {
  Json levels = Json::array();
  for (const LevelRange& range : subject.levels) levels.push_back({range.first, range.last});
  return {{"fabrics", subject.fabrics.size()},
          {"fabricLevels", levels},
          {"fabricBytes", {{"read", subject.bytes_read}, {"inFiles", subject.file_bytes}}},
          {"triangles", stats.triangles},
          {"layers", stats.layers},
          {"coveredPixels", stats.covered_pixels},
          {"evaluatedPixels", stats.evaluated_pixels},
          {"remarks", stats.remarks},
          {"warnings", lines_of(subject.issues)},
          {"seconds", to_json(stats)}};
}

Json to_json(const RenderCommand& command, const Shot& shot, const Series& series) {
  Json all = {{"program", "selvedge-view"},
              {"version", SELVEDGE_VERSION},
              {"report", 1},
              {"verb", "render"},
              {"input", command.input},
              {"outputs", command.outputs},
              {"width", shot.options.width},
              {"height", shot.options.height},
              {"frames", shot.cameras.size()},
              {"supersample", shot.options.supersample},
              {"path", path_names[static_cast<std::size_t>(shot.options.path)]},
              {"threads", thread_count()}};
  all.update(to_json(shot.subjects.front(), series.stats().front()));
  if (shot.subjects.size() > 1) {
    all["compare"] = {{"input", command.compare}};
    all["compare"].update(to_json(shot.subjects[1], series.stats()[1]));
  }
  return all;
}

void print_remarks(const Shot& shot, const Series& series) {
  for (std::size_t i = 0; i < shot.subjects.size(); ++i) {
    for (const Error& issue : shot.subjects[i].issues)
      fmt::print(stderr, "selvedge-view: warning: {}\n", to_line(issue));
    for (const std::vector<std::string>& remarks :
         {shot.subjects[i].scene.remarks, series.stats()[i].remarks}) {
      for (const std::string& remark : remarks)
        fmt::print(stderr, "selvedge-view: note: {}\n", printable(remark));
    }
  }
}

Result<void> check_paths(const RenderCommand& command) {
  std::vector<std::pair<std::string, std::string>> paths{{"the input", command.input},
                                                         {"--compare", command.compare}};
  if (command.stats != "-") paths.emplace_back("--stats", command.stats);
  for (const std::string& output : command.outputs) paths.emplace_back("--output", output);
  // The same scene may be compared with itself.
  if (command.compare == command.input) paths.erase(paths.begin() + 1);
  return check_distinct(paths);
}

Result<void> render_all(const RenderCommand& command) {
  if (command.outputs.size() * static_cast<std::size_t>(std::max(command.turntable, 1)) > max_files) {
    return fail(Code::option_out_of_range, "", "--turntable",
                fmt::format("makes more than {} files at once", max_files));
  }
  if (auto good = check_paths(command); !good) return good;
  std::optional<AtomicFile> stats_file;
  if (!command.stats.empty() && command.stats != "-") {
    Result<AtomicFile> file = AtomicFile::create(command.stats);
    if (!file) return tl::unexpected(file.error());
    stats_file.emplace(std::move(*file));
  }
  const Clock::time_point start = Clock::now();
  // Said before a large garment is read.
  if (command.turntable == 0) {
    for (const std::string& path : command.outputs) {
      if (const auto writable = AtomicFile::create(path); !writable) return tl::unexpected(writable.error());
    }
  }
  const Result<Shot> shot =
      has_ending(command.input, ".exr") ? read_swatch(command) : read_scene_shot(command);
  if (!shot) return tl::unexpected(shot.error());
  const double read = seconds_since(start);
  Series series(command, *shot);
  if (auto good = series.open_files(); !good) return good;
  if (auto good = series.draw(); !good) return good;
  if (auto good = series.commit(); !good) return good;
  if (!command.quiet) print_remarks(*shot, series);
  Json all = to_json(command, *shot, series);
  all["seconds"]["read"] = read;
  all["seconds"]["write"] = series.write_seconds();
  all["seconds"]["total"] = seconds_since(start);
  const std::string text = all.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
  if (command.json || command.stats == "-") fmt::print("{}", text);
  if (!stats_file) return {};
  if (auto good = write_file(stats_file->temporary(), text); !good) return good;
  return stats_file->commit();
}

}  // namespace

int run(const RenderCommand& command) {
  set_threads(command.threads);
  limit_mesa_threads(command.threads);
  const auto good = render_all(command);
  if (good) return 0;
  fmt::print(stderr, "selvedge-view: {}\n", to_line(good.error()));
  return 1;
}

}  // namespace selvedge
