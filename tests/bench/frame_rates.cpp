#include "tests/bench/frame_rates.h"

#include "format/base/parallel.h"
#include "tests/bench/drawn.h"

namespace selvedge::bench {
namespace {

constexpr V2i size(1920, 1080);
constexpr int frames = 20;

struct View {
  const char* name;
  double pixels_of_a_repeat;  ///< in the frame's middle
};
constexpr std::array views{View{"whole", 8}, View{"band", 30}, View{"close", 120}};

struct Drawing {
  explicit Drawing(const Subject& of) : subject(of) {
    options.levels = best_levels;
    options.context = ContextKind::osmesa;
    options.width = size.x;
    options.height = size.y;
    renderer = need(Renderer::create(subject.scene, subject.fabrics, options));
  }

  Camera camera(double zoom, double azimuth) const {
    CameraOptions view;
    view.zoom = zoom;
    view.azimuth = azimuth;
    return need(make_camera(subject.points, static_cast<double>(size.x) / size.y, view));
  }

  double pixels_of_a_repeat(double zoom) {
    const auto probe = need(renderer->probe(camera(zoom, 0), options, V2i(size.x / 2, size.y / 2)));
    if (!probe || probe->fabric < 0) return 0;
    return whole_texels(subject.fabrics[probe->fabric]).x / probe->texels_per_pixel.x;
  }

  Sample draw(double zoom, int number) {
    const Camera at = camera(zoom, 0.05 * number);
    options.lights = default_lights(at);
    Sample sample;
    const double start = wall_seconds();
    const double start_processor = cpu_seconds();
    need(renderer->draw(at, options, frame, sample.stats));
    sample.wall = wall_seconds() - start;
    sample.processor = cpu_seconds() - start_processor;
    return sample;
  }

  const Subject& subject;
  RenderOptions options;
  std::unique_ptr<Renderer> renderer;
  Frame frame;
};

}  // namespace

void frame_rates(const std::string& scene_file, Rows& rows) {
  const Subject subject = load(scene_file);
  Drawing drawing(subject);
  const double whole = drawing.pixels_of_a_repeat(1);
  fmt::print(
      "{}: {} x {}, {} threads, two lights, default filter; ms, medians of {}\n\n"
      "| | pixels a repeat | covered | surfaces evaluated | project | geometry | read back | texels, frames, "
      "light | frame | processor | frames/s |\n|---|---|---|---|---|---|---|---|---|---|---|\n",
      subject.name, size.x, size.y, thread_count(), frames);
  for (const View& view : views) {
    const double zoom = view.pixels_of_a_repeat / whole;
    Samples samples;
    for (int i = -2; i < frames; ++i) {
      const Sample sample = drawing.draw(zoom, i);
      if (i >= 0) samples.add(sample);
    }
    const RenderStats& last = samples.last();
    fmt::print(
        "| {} | {:.1f} | {:.1f} % | {:.2f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.2f} "
        "|\n",
        view.name, drawing.pixels_of_a_repeat(zoom),
        100.0 * static_cast<double>(last.covered_pixels) / (size.x * size.y),
        static_cast<double>(last.evaluated_pixels) / static_cast<double>(last.covered_pixels),
        samples.stage(&RenderStats::project), samples.stage(&RenderStats::geometry),
        samples.stage(&RenderStats::read_back), samples.stage(&RenderStats::evaluation), samples.frame(),
        samples.processor(), 1e3 / samples.frame());
    std::fflush(stdout);
    const std::string name = fmt::format("rate/{}/{}", subject.name, view.name);
    rows.add(name, 1e3 / samples.frame(), "frames/s");
    rows.add(name + "/processor", samples.processor(), "ms");
  }
  fmt::print("\n");
}

}  // namespace selvedge::bench
