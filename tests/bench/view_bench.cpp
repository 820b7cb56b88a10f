// Frames of dressed garments: selvedge-bench-view [--rows FILE] [--rates] SCENE.glb ...
// With --rates: frames a second of the whole garment, of a view in which a repeat has 30 pixels, and of one
// in which it has 120 and the cloth fills the frame, and the stages of a frame. Otherwise ms of a frame by
// every path, and how fast the fabric is evaluated beside the reference.
#include <algorithm>
#include <filesystem>
#include <functional>

#include "format/base/parallel.h"
#include "format/fabric/evaluate.h"
#include "tests/bench/rows.h"
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

  double pixels_of_a_repeat(double of_zoom) {
    const auto probe = need(renderer_->probe(camera(of_zoom, 0), options_, size / 2));
    if (!probe || probe->fabric < 0) return 0;
    return subject_.loaded.fabrics[probe->fabric].levels.front().width / probe->texels_per_pixel.x;
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
  Camera camera(double of_zoom, double azimuth) const {
    CameraOptions view;
    view.zoom = of_zoom;
    view.azimuth = azimuth;
    return need(make_camera(subject_.points, static_cast<double>(size.x) / size.y, view));
  }

  const Subject& subject_;
  RenderOptions options_;
  std::unique_ptr<Renderer> renderer_;
};

double covered_percent(const RenderStats& stats) {
  return 100.0 * static_cast<double>(stats.covered_pixels) / (size.x * size.y);
}

void frame_rates(const Subject& subject, bench::Rows& rows) {
  constexpr int frames = 20;
  struct View {
    const char* name;
    double pixels_of_a_repeat;  ///< in the frame's middle
  };
  Drawing drawing(subject, RenderPath::hybrid, best_levels);
  const double whole = drawing.pixels_of_a_repeat(1);
  fmt::print(
      "{}: {} x {}, {} threads, two lights, default filter; ms, medians of {}\n\n"
      "| | pixels a repeat | covered | surfaces evaluated | project | geometry | read back | texels, frames, "
      "light | frame | processor | frames/s |\n|---|---|---|---|---|---|---|---|---|---|---|\n",
      subject.name, size.x, size.y, thread_count(), frames);
  for (const View& view : {View{"whole", 8}, View{"band", 30}, View{"close", 120}}) {
    const double of_zoom = view.pixels_of_a_repeat / whole;
    const Samples samples = drawing.draw(of_zoom, 0.05, frames);
    const RenderStats& last = samples.last();
    fmt::print("| {} | {:.1f} | {:.1f} % | {:.2f} | {} | {:.2f} |\n", view.name,
               drawing.pixels_of_a_repeat(of_zoom), covered_percent(last),
               static_cast<double>(last.evaluated_pixels) / static_cast<double>(last.covered_pixels),
               samples.text(), 1e3 / samples.frame());
    std::fflush(stdout);
    const std::string name = fmt::format("rate/{}/{}", subject.name, view.name);
    rows.add(name, 1e3 / samples.frame(), "frames/s");
    rows.add(name + "/processor", samples.processor(), "ms");
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

/// Pixels in sixteens, each with two texels under two lights: what a frame asks for.
struct Lanes {
  LaneDirections view;
  std::array<LaneLight, 2> lights;
  std::array<LaneTexels, 2> texels;
};

std::vector<Lanes> make_lanes(const Fabric& fabric) {
  const std::vector<DirectionPair> pairs = random_pairs(1024, 0.05, 1);
  std::vector<Lanes> all(256);
  std::size_t number = 0;
  for (Lanes& block : all) {
    for (std::size_t lane = 0; lane < lane_count; ++lane, ++number) {
      const auto set = [&](LaneDirections& to, const V3f& d) {
        to.x[lane] = d.x;
        to.y[lane] = d.y;
        to.z[lane] = d.z;
      };
      set(block.view, pairs[number % 1024].view);
      for (std::size_t i = 0; i < 2; ++i) {
        set(block.lights[i].direction, pairs[(number + 5 * i) % 1024].light);
        block.lights[i].share[lane] = 1;
        const std::size_t level = std::min(1 + i, fabric.levels.size() - 1);
        block.texels[i].level[lane] = static_cast<std::int32_t>(level);
        block.texels[i].texel[lane] =
            static_cast<std::int32_t>(number * 7 % static_cast<std::size_t>(fabric.levels[level].texels()));
        block.texels[i].weight[lane] = 0.5F;
      }
    }
  }
  return all;
}

/// Evaluations (one texel under one light) per second, the best of twelve.
template <class Body>
double rate(std::size_t blocks, const Body& body) {
  double best = 0;
  for (int repeat = 0; repeat < 12; ++repeat) {
    const double start = bench::wall_seconds();
    body();
    best = std::max(best, static_cast<double>(blocks * lane_count * 4) / (bench::wall_seconds() - start));
  }
  return best;
}

/// On one thread, sixteen pixels at once beside the reference.
void evaluate_rates(const Fabric& fabric, const std::string& name, bench::Rows& rows) {
  const PackedFabric packed = pack(fabric);
  const std::vector<Lanes> all = make_lanes(fabric);
  float kept = 0;  // so that the compiler leaves nothing out
  const double scalar = rate(all.size(), [&] {
    for (const Lanes& block : all) {
      for (std::size_t lane = 0; lane < lane_count; ++lane) {
        const auto of_lane = [lane](const LaneDirections& d) { return V3f(d.x[lane], d.y[lane], d.z[lane]); };
        for (const LaneTexels& of : block.texels) {
          const int columns = fabric.levels[of.level[lane]].width;
          for (const LaneLight& light : block.lights) {
            kept += evaluate(fabric, of.level[lane], of.texel[lane] % columns, of.texel[lane] / columns,
                             of_lane(light.direction), of_lane(block.view))
                        .radiance.x;
          }
        }
      }
    }
  });
  const double lanes = rate(all.size(), [&] {
    LaneScratch scratch;
    LaneShading sum;
    for (const Lanes& block : all)
      evaluate_lanes(packed, block.texels, block.view, block.lights, scratch, sum);
    kept += sum.red[0];
  });
  fmt::print("{}: reference {:.1f} M evaluations/s a thread, sixteen at once {:.1f} M/s = {:.1f} x{}\n", name,
             scalar / 1e6, lanes / 1e6, lanes / scalar, std::isnan(kept) ? " (NaN)" : "");
  rows.add("evaluation/" + name + "/one_thread", lanes / scalar, "x reference");
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
  if (!rates && !subjects.front().loaded.fabrics.empty())
    evaluate_rates(subjects.front().loaded.fabrics.front(), subjects.front().name, rows);
  rows.write();
  return 0;
}
