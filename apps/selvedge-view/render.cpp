// render: draws a scene, or a swatch of a fabric, to PNG and EXR files.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <future>

#include "apps/selvedge-view/commands.h"
#include "apps/selvedge-view/shot.h"
#include "format/base/atomic_file.h"
#include "format/base/option_text.h"
#include "format/base/parallel.h"
#include "format/base/printable.h"
#include "viewer/renderer.h"
#include "viewer/turntable.h"

namespace selvedge {
namespace {

using Clock = std::chrono::steady_clock;

/// Maximum number of files of one run, which are all open until the last is written.
constexpr std::size_t max_files = 720;
/// Width of the line between two pictures, pixels.
constexpr int divider_width = 4;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Two frames of one size with an opaque black line between them.
Frame side_by_side(const Frame& left, const Frame& right) {
  Frame both{left.width + divider_width + right.width, left.height, {}};
  both.pixels.reserve(both.width * both.height);
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

Result<void> write(const DisplayOptions& display, const Frame& frame, const std::string& like,
                   const std::string& path) {
  if (has_ending(like, ".exr")) return write_exr(path, to_linear_image(frame));
  return write_png(path, to_display_image(frame, display));
}

void add(const RenderStats& one, RenderStats& sum) {
  sum.prepare = one.prepare;
  sum.project += one.project;
  sum.shadows += one.shadows;
  sum.geometry += one.geometry;
  sum.read_back += one.read_back;
  sum.evaluation += one.evaluation;
  sum.filter += one.filter;
  sum.triangles = one.triangles;
  sum.covered_pixels += one.covered_pixels;
  sum.evaluated_pixels += one.evaluated_pixels;
  sum.layers = std::max(sum.layers, one.layers);
  sum.remarks = one.remarks;
}

/// Writes all frames to temporary files beside their final places.
class Series {
 public:
  Series(const RenderCommand& command, const Shot& shot) : command_(command), shot_(shot) {}

  /// Opens all files first, so that an unwritable folder is reported before the work.
  void open_files() {
    for (std::size_t frame = 0; frame < shot_.cameras.size(); ++frame) {
      for (const std::string& path : command_.outputs) {
        files_.push_back(must(
            AtomicFile::create(command_.turntable > 0 ? frame_path(path, static_cast<int>(frame)) : path)));
      }
    }
  }

  void draw() {
    std::vector<std::unique_ptr<Renderer>> renderers;
    for (const Subject& subject : shot_.subjects) {
      renderers.push_back(must(Renderer::create(subject.scene, subject.fabrics, shot_.options)));
    }
    stats_.resize(renderers.size());
    std::array<Frame, 2> frames;
    Frame drawn;
    // A frame is written while the next is drawn.
    std::future<Result<void>> writing;
    const auto finish = [&] {
      if (writing.valid()) must(writing.get());
    };
    std::size_t first_file = 0;
    for (const Camera& camera : shot_.cameras) {
      RenderOptions options = shot_.options;
      options.lights = shot_.look.all_lights(camera);
      for (std::size_t i = 0; i < renderers.size(); ++i) {
        RenderStats stats;
        must(renderers[i]->draw(camera, options, frames[i], stats));
        add(stats, stats_[i]);
      }
      finish();
      if (renderers.size() > 1) frames[0] = side_by_side(frames[0], frames[1]);
      std::swap(drawn, frames[0]);
      const auto policy = thread_count() > 1 ? std::launch::async : std::launch::deferred;
      writing = std::async(policy, [this, &drawn, first_file] { return write_all(drawn, first_file); });
      first_file += command_.outputs.size();
    }
    finish();
  }

  /// Moves all files to their final places.
  void commit() { must(commit_all(std::move(files_))); }

  const std::vector<RenderStats>& stats() const { return stats_; }
  double write_seconds() const { return write_seconds_; }

 private:
  /// Writes a frame to its files.
  Result<void> write_all(const Frame& frame, std::size_t file) {
    const Clock::time_point start = Clock::now();
    for (const std::string& path : command_.outputs) {
      if (auto good = write(shot_.look.display, frame, path, files_[file].temporary()); !good) {
        Error error = good.error();
        error.file = files_[file].path();
        return tl::unexpected(error);
      }
      ++file;
    }
    write_seconds_ += seconds_since(start);
    return {};
  }

  const RenderCommand& command_;
  const Shot& shot_;
  std::vector<AtomicFile> files_;
  std::vector<RenderStats> stats_;  ///< of the subjects, over all frames
  double write_seconds_ = 0;
};

Json to_json(const RenderStats& stats) {
  return {{"prepare", stats.prepare},   {"project", stats.project},    {"shadows", stats.shadows},
          {"geometry", stats.geometry}, {"readBack", stats.read_back}, {"evaluation", stats.evaluation},
          {"filter", stats.filter}};
}

Json to_json(const Subject& subject, const RenderStats& stats) {
  return {{"fabrics", subject.fabrics.size()},
          {"fabricBytes", subject.file_bytes},
          {"triangles", stats.triangles},
          {"layers", stats.layers},
          {"coveredPixels", stats.covered_pixels},
          {"evaluatedPixels", stats.evaluated_pixels},
          {"remarks", stats.remarks},
          {"seconds", to_json(stats)}};
}

Json to_json(const RenderCommand& command, const Shot& shot, const Series& series) {
  Json all = {{"input", command.picture.input},
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
    for (const std::vector<std::string>& remarks :
         {shot.subjects[i].scene.remarks, series.stats()[i].remarks}) {
      for (const std::string& remark : remarks)
        fmt::print(stderr, "selvedge-view: note: {}\n", printable(remark));
    }
  }
}

Result<int> run(const RenderCommand& command) {
  limit_mesa_threads(command.common.threads);
  if (command.outputs.size() * static_cast<std::size_t>(std::max(command.turntable, 1)) > max_files) {
    return fail(Code::option_out_of_range, "", "--turntable",
                fmt::format("makes more than {} files at once", max_files));
  }
  const std::string stats_file = command.stats == "-" ? "" : command.stats;
  must(check_writable({stats_file}));
  const Clock::time_point start = Clock::now();
  // Reported before a large garment is read.
  if (command.turntable == 0) must(check_writable(command.outputs));
  const Shot shot = read_shot(command);
  const double read = seconds_since(start);
  Series series(command, shot);
  series.open_files();
  series.draw();
  series.commit();
  if (!command.common.quiet) print_remarks(shot, series);
  Json all = to_json(command, shot, series);
  all["seconds"]["read"] = read;
  all["seconds"]["write"] = series.write_seconds();
  all["seconds"]["total"] = seconds_since(start);
  const std::string text = report_text(framed("render", all));
  if (command.common.json || command.stats == "-") fmt::print("{}", text);
  if (!stats_file.empty()) must(write_file(stats_file, text));
  return 0;
}

}  // namespace

void limit_mesa_threads(int threads) {
  if (threads > 0) setenv("LP_NUM_THREADS", fmt::format("{}", threads).c_str(), 0);
}

void add_render_verb(Program& program) {
  program.add<RenderCommand>(
      {"render", "Draw a scene, or a swatch of a fabric, into PNG and EXR files",
       "selvedge-view render sweater.glb -o sweater.png --size 1280x960 --azimuth 30 --supersample 2\n"
       "selvedge-view render knit.fabric.exr -o knit.exr --repeats 4x4 --light 0,0.5,1 --view 0,-1,1",
       "PNG: radiance * exposure, tone curve, over the background, clipped, sRGB.\n"
       "EXR: linear radiance * opacity, and opacity.\n"
       "Tone curves of an exposed colour c: reinhard is c / (1 + Y), Y its luminance (Reinhard et al. 2002,\n"
       "equation 3); aces is c (2.51 c + 0.03) / (c (2.43 c + 0.59) + 0.14) per channel (Narkowicz 2016).\n"},
      declare, run);
}

}  // namespace selvedge
