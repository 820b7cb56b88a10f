// Garments in environments: how far a frame is from the sum over all pixels of the environment as lamps, and
// its time beside that in two lamps:
// selvedge-bench-environment [--rows FILE] ENVIRONMENT.hdr ... SCENE.glb ...
#include "format/picture/studio.h"
#include "tests/bench/drawn.h"
#include "tests/bench/pictures.h"

namespace {

using namespace selvedge;
using bench::need;

/// Sums are taken over a picture of this width.
constexpr int sum_width = 256;
constexpr V2i size(120, 90);
constexpr V2i timed_size(640, 480);
constexpr int frames = 7;
constexpr std::size_t lamps_at_once = 64;

struct View {
  const char* name;
  double zoom;
};
constexpr std::array views{View{"whole", 1}, View{"close", 12}};

RenderOptions options_of(const V2i& of_size) {
  RenderOptions options;
  options.width = of_size.x;
  options.height = of_size.y;
  options.levels = best_levels;
  options.context = ContextKind::osmesa;
  return options;
}

Camera camera_of(const bench::Subject& subject, double zoom) {
  CameraOptions view;
  view.zoom = zoom;
  view.azimuth = 20;
  view.focus = {0.5, 0.4};
  return need(make_camera(subject.points, static_cast<double>(size.x) / size.y, view));
}

/// The frame in the light of all pixels of the environment.
Frame summed(Renderer& renderer, const Camera& camera, const Environment& environment) {
  const std::vector<Light> lamps = lamps_of(reduced(environment, sum_width));
  RenderOptions options = options_of(size);
  Frame sum;
  for (std::size_t first = 0; first < lamps.size(); first += lamps_at_once) {
    const std::size_t count = std::min(lamps_at_once, lamps.size() - first);
    options.lights.assign(lamps.begin() + static_cast<std::ptrdiff_t>(first),
                          lamps.begin() + static_cast<std::ptrdiff_t>(first + count));
    Frame frame;
    RenderStats stats;
    need(renderer.draw(camera, options, frame, stats));
    if (first == 0) {
      sum = std::move(frame);
      continue;
    }
    for (std::size_t i = 0; i < sum.pixels.size(); ++i) {
      for (unsigned c = 0; c < 3; ++c) sum.pixels[i][c] += frame.pixels[i][c];
    }
  }
  return sum;
}

double milliseconds(Renderer& renderer, const Camera& camera, const RenderOptions& options) {
  bench::Samples samples;
  Frame frame;
  for (int i = -1; i < frames; ++i) {
    bench::Sample sample;
    const double start = bench::cpu_seconds();
    need(renderer.draw(camera, options, frame, sample.stats));
    sample.processor = bench::cpu_seconds() - start;
    if (i >= 0) samples.add(sample);
  }
  return samples.processor();
}

}  // namespace

int main(int argc, char** argv) {
  bench::Rows rows(argc, argv);
  std::vector<std::string> environments;
  std::vector<std::string> scenes;
  for (const std::string& file : rows.arguments())
    (std::filesystem::path(file).extension() == ".glb" ? scenes : environments).push_back(file);
  if (environments.empty() || scenes.empty()) {
    fmt::print(stderr, "usage: selvedge-bench-environment [--rows FILE] ENVIRONMENT.hdr ... SCENE.glb ...\n");
    return 2;
  }
  fmt::print(
      "| scene | view | environment | lamps | dB from the sum | time, two lamps = 1 |\n"
      "|---|---|---|---|---|---|\n");
  for (const std::string& scene : scenes) {
    const bench::Subject subject = bench::load(scene);
    const auto renderer = need(Renderer::create(subject.scene, subject.fabrics, options_of(size)));
    const auto timed = need(Renderer::create(subject.scene, subject.fabrics, options_of(timed_size)));
    for (const View& view : views) {
      const Camera camera = camera_of(subject, view.zoom);
      for (const std::string& file : environments) {
        // White under mean light is as bright as in the other benches.
        Environment environment = need(environment_named(file, {0, std::numbers::inv_pi}));
        const EnvironmentLight light = divide(environment);
        RenderOptions options = options_of(size);
        options.lights = light.lamps;
        options.around = light.rest;
        Frame frame;
        RenderStats stats;
        need(renderer->draw(camera, options, frame, stats));
        const double dB = bench::difference(frame, summed(*renderer, camera, environment)).psnr;
        options.width = timed_size.x;
        options.height = timed_size.y;
        const double in_environment = milliseconds(*timed, camera, options);
        options.around.reset();
        options.lights = default_lights(camera);
        const double ratio = in_environment / milliseconds(*timed, camera, options);
        const std::string name = std::filesystem::path(file).stem().string();
        fmt::print("| {} | {} | {} | {} | {:.1f} | {:.2f} |\n", subject.name, view.name, name,
                   light.lamps.size(), dB, ratio);
        std::fflush(stdout);
        rows.add(fmt::format("environment/{}/{}/{}", subject.name, view.name, name), dB, "dB");
      }
    }
  }
  rows.write();
}
