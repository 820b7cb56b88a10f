// Frames of dressed garments: selvedge-bench-view [--rows FILE] [--rates] SCENE.glb ...
// With --rates: frames of an orbit around the garment, and at rest, with 8, 15, 30 and 120 pixels a repeat,
// two lamps fixed to the garment and its shadows: processor time, and dB to 8 x 8 rays a pixel of the shader
// path, without and with the garment's shadows. Otherwise ms of a frame by every path, and how fast the
// fabric is evaluated beside the reference.
#include <algorithm>
#include <filesystem>
#include <functional>
#include <numbers>

#include "format/base/parallel.h"
#include "format/fabric/evaluate.h"
#include "tests/bench/rows.h"
#include "viewer/light/shadows.h"
#include "viewer/load.h"
#include "viewer/renderer.h"

namespace {

using namespace selvedge;
using bench::need;

constexpr V2i size(1920, 1080);
constexpr double zoom = 1.15;  ///< the sweater then covers more than half of the pixels

struct Subject {
  std::string name;
  LoadedScene loaded;
  std::vector<V3d> points;
};

Subject load(const std::string& path) {
  Subject subject{std::filesystem::path(path).stem().string(), need(load_scene(path)), {}};
  subject.points = need(world_points(subject.loaded.scene));
  return subject;
}

struct Sample {
  double wall = 0;
  double processor = 0;
  RenderStats stats;
};

/// Medians over frames, ms.
class Samples {
 public:
  void add(const Sample& sample) { samples_.push_back(sample); }
  double frame() const { return median(&Sample::wall); }
  double processor() const { return median(&Sample::processor); }
  double stage(double RenderStats::*seconds) const {
    return median([seconds](const Sample& s) { return s.stats.*seconds; });
  }
  /// "project | geometry | read back | evaluation | frame | processor".
  std::string text() const {
    return fmt::format("{:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f}", stage(&RenderStats::project),
                       stage(&RenderStats::geometry), stage(&RenderStats::read_back),
                       stage(&RenderStats::evaluation), frame(), processor());
  }
  const RenderStats& last() const { return samples_.back().stats; }

 private:
  template <class Seconds>
  double median(const Seconds& seconds) const {
    std::vector<double> values;
    for (const Sample& s : samples_) values.push_back(std::invoke(seconds, s) * 1e3);
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  }
  std::vector<Sample> samples_;
};

Camera camera_at(const Subject& subject, double of_zoom, double azimuth) {
  CameraOptions view;
  view.zoom = of_zoom;
  view.azimuth = azimuth;
  return need(make_camera(subject.points, static_cast<double>(size.x) / size.y, view));
}

class Drawing {
 public:
  Drawing(const Subject& subject, RenderPath path, const LevelOptions& levels) : subject_(subject) {
    options_.path = path;
    options_.levels = levels;
    options_.context = ContextKind::osmesa;
    options_.width = size.x;
    options_.height = size.y;
    renderer_ = need(Renderer::create(subject.loaded.scene, subject.loaded.fabrics, options_));
  }

  /// So many frames of a slow turn after `first` others, which compile shaders and touch memory for the first
  /// time.
  Samples draw(double of_zoom, double degrees, int frames, int first = 2) {
    Samples samples;
    Frame frame;
    for (int i = -first; i < frames; ++i) {
      const Camera at = camera(of_zoom, degrees * i);
      options_.lights = default_lights(at);
      Sample sample;
      const double start = bench::wall_seconds();
      const double start_processor = bench::cpu_seconds();
      need(renderer_->draw(at, options_, frame, sample.stats));
      sample.wall = bench::wall_seconds() - start;
      sample.processor = bench::cpu_seconds() - start_processor;
      if (i >= 0) samples.add(sample);
    }
    return samples;
  }

 private:
  Camera camera(double of_zoom, double azimuth) const { return camera_at(subject_, of_zoom, azimuth); }

  const Subject& subject_;
  RenderOptions options_;
  std::unique_ptr<Renderer> renderer_;
};

double covered_percent(const RenderStats& stats) {
  return 100.0 * static_cast<double>(stats.covered_pixels) / (size.x * size.y);
}

/// 8-bit display value over grey.
double displayed(const V4f& pixel, int channel) {
  const double c = std::clamp(
      std::numbers::pi * static_cast<double>(pixel[channel]) + 0.18 * (1 - static_cast<double>(pixel.w)), 0.0,
      1.0);
  return 255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055);
}

/// PSNR in dB of the middle of a frame to a smaller one, where either shows something.
double decibels(const Frame& frame, const Frame& middle) {
  double sum = 0;
  double count = 0;
  for (int y = 0; y < middle.height; ++y) {
    for (int x = 0; x < middle.width; ++x) {
      const V4f& a = frame.pixels[(y + (frame.height - middle.height) / 2) * frame.width + x +
                                  (frame.width - middle.width) / 2];
      const V4f& b = middle.pixels[y * middle.width + x];
      if (!(a.w > 0 || b.w > 0)) continue;
      for (int c = 0; c < 3; ++c) sum += std::pow(displayed(a, c) - displayed(b, c), 2);
      count += 3;
    }
  }
  return 10 * std::log10(255 * 255 * count / std::max(sum, 1e-9));
}

class Rates {
 public:
  explicit Rates(const Subject& subject) : subject_(subject) {
    options_.context = ContextKind::osmesa;
    options_.lights = default_lights(camera(1, 0));
    const auto probe = need(renderer(options_)->probe(camera(1, 0), sized(options_, 1), size / 2));
    if (probe && probe->fabric >= 0)
      whole_ = subject.loaded.fabrics[probe->fabric].levels.front().width / probe->texels_per_pixel.x;
  }

  /// `degrees`: of a frame of the orbit.
  void measure(const char* name, double pixels_of_a_repeat, double degrees, int shadows, bench::Rows& rows) {
    const double of_zoom = pixels_of_a_repeat / whole_;
    RenderOptions options = sized(options_, 1);
    options.shadows = shadows;
    // The middle of the frame, a twelfth along either side; of the whole garment, a sixth.
    const int part = pixels_of_a_repeat > 10 ? 12 : 6;
    RenderOptions rays = sized(options, part);
    rays.path = RenderPath::shader;
    rays.supersample = 8;
    rays.levels.points = 1;
    RenderStats stats;
    Frame reference;
    need(renderer(rays)->draw(camera(of_zoom * part, 0), rays, reference, stats));

    constexpr int frames = 24;
    Frame frame;
    std::vector<double> times;
    options.cells = moving_cell_images;
    const auto moving = renderer(options);
    for (int i = -frames; i <= 0; ++i) {
      const double start = bench::cpu_seconds();
      need(moving->draw(camera(of_zoom, degrees * i), options, frame, stats));
      if (i > -frames / 2) times.push_back(1e3 * (bench::cpu_seconds() - start));
    }
    std::nth_element(times.begin(), times.begin() + frames / 4, times.end());
    const double milliseconds = times[frames / 4];
    const double moving_db = decibels(frame, reference);
    options.cells = {};
    options.supersample = 2;
    const auto at_rest = renderer(options);
    const double start = bench::wall_seconds();
    need(at_rest->draw(camera(of_zoom, 0), options, frame, stats));
    const double seconds = bench::wall_seconds() - start;
    const double rest_db = decibels(frame, reference);
    fmt::print("| {} | {:.0f} | {} | {:.0f} | {:.1f} | {:.1f} | {:.1f} |\n", name, pixels_of_a_repeat,
               shadows, milliseconds, moving_db, seconds, rest_db);
    std::fflush(stdout);
    const std::string row = fmt::format("rate/{}/{}/{}", subject_.name, name, shadows);
    rows.add(row + "/moving", milliseconds, "ms");
    rows.add(row + "/moving/dB", moving_db, "dB");
    rows.add(row + "/rest/dB", rest_db, "dB");
  }

 private:
  static RenderOptions sized(RenderOptions options, int part) {
    options.width = size.x / part;
    options.height = size.y / part;
    return options;
  }
  std::unique_ptr<Renderer> renderer(const RenderOptions& options) const {
    return need(Renderer::create(subject_.loaded.scene, subject_.loaded.fabrics, options));
  }
  Camera camera(double of_zoom, double azimuth) const { return camera_at(subject_, of_zoom, azimuth); }

  const Subject& subject_;
  RenderOptions options_;
  double whole_ = 1;  ///< pixels of a repeat at zoom 1
};

void frame_rates(const Subject& subject, bench::Rows& rows) {
  fmt::print(
      "{}: {} x {}, {} threads\n\n| view | pixels a repeat | shadow maps | moving, ms of processor | dB | at "
      "rest, s "
      "| dB |\n|---|---|---|---|---|---|---|\n",
      subject.name, size.x, size.y, thread_count());
  Rates rates(subject);
  for (const int shadows : {0, default_shadow_size}) {
    rates.measure("whole", 8, 1, shadows, rows);
    rates.measure("patch of a line", 15, 1, shadows, rows);
    rates.measure("band", 30, 1, shadows, rows);
    rates.measure("close", 120, 0.5, shadows, rows);
  }
}

/// Nearest texels; a frame by the shader path takes seconds on the software rasteriser.
void draw_by_all_paths(const Subject& subject, bench::Rows& rows) {
  for (const RenderPath path : {RenderPath::hybrid, RenderPath::shader}) {
    const std::string name(path_names[static_cast<std::size_t>(path)]);
    const bool hybrid = path == RenderPath::hybrid;
    const Samples samples = Drawing(subject, path, {}).draw(zoom, 0.25, hybrid ? 30 : 1, hybrid ? 2 : 0);
    fmt::print("| {} | {} | {:.1f} % | {} |\n", subject.name, name, covered_percent(samples.last()),
               samples.text());
    std::fflush(stdout);
    rows.add(fmt::format("frame/{}/{}", subject.name, name), samples.frame(), "ms");
    rows.add(fmt::format("frame/{}/{}/processor", subject.name, name), samples.processor(), "ms");
  }
}

}  // namespace

int main(int argc, char** argv) {
  bench::Rows rows(argc, argv);
  std::vector<std::string> files = rows.arguments();
  const bool rates = !files.empty() && files[0] == "--rates";
  if (rates) files.erase(files.begin());
  if (files.empty()) {
    fmt::print(stderr, "usage: selvedge-bench-view [--rows FILE] [--rates] SCENE.glb ...\n");
    return 2;
  }
  std::vector<Subject> subjects;
  for (const std::string& file : files) subjects.push_back(load(file));
  if (!rates) {
    fmt::print(
        "| scene | path | covered | project | geometry | read back | texels, frames, light | frame (ms) | "
        "processor "
        "|\n|---|---|---|---|---|---|---|---|---|\n");
  }
  for (const Subject& subject : subjects)
    rates ? frame_rates(subject, rows) : draw_by_all_paths(subject, rows);
  rows.write();
  return 0;
}
