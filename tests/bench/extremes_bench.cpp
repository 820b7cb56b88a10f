// Scenes too large for the tests: how long they take and how much memory: selvedge-bench-extremes
#include <fmt/format.h>
#include <sys/resource.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "tests/bench/rows.h"
#include "tests/format/fabrics.h"
#include "tests/viewer/shapes.h"
#include "viewer/renderer.h"
#include "viewer/scene/surfaces.h"

namespace {

using namespace selvedge;

double peak_mib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

/// Two frames of a sphere of that many columns, half as many rows; the second is timed.
void draw(const char* name, int columns, int width, int height, std::size_t lights) {
  Scene scene;
  test::add(scene, test::sphere(columns, columns / 2, V2d(200, 100)), test::material(0));
  const std::vector<Fabric> fabrics{test::random_fabric(32, 32, 1)};
  const Camera camera =
      bench::need(make_camera(bench::need(world_points(scene)), static_cast<double>(width) / height, {}));
  RenderOptions options;
  options.width = width;
  options.height = height;
  for (std::size_t i = 0; i < lights; ++i) {
    Light light;
    const double turn = static_cast<double>(i);
    light.direction = V3d(std::sin(turn), 0.5, std::cos(turn)).normalized();
    light.irradiance = V3f(1 / static_cast<float>(lights));
    options.lights.push_back(light);
  }
  const double start = bench::wall_seconds();
  const auto renderer = bench::need(Renderer::create(scene, fabrics, options));
  const double ready = bench::wall_seconds();
  Frame frame;
  RenderStats stats;
  double drawn = 0;
  for (int i = 0; i < 2; ++i) {
    const double before = bench::wall_seconds();
    if (const auto good = renderer->draw(camera, options, frame, stats); !good) std::exit(1);
    drawn = bench::wall_seconds() - before;
  }
  int wrong = 0;
  for (const V4f& p : frame.pixels) wrong += std::isfinite(p.x + p.y + p.z + p.w) ? 0 : 1;
  fmt::print("| {} | {} | {}x{} | {} | {:.2f} | {:.3f} | {} | {:.0f} |\n", name, stats.triangles, width,
             height, lights, ready - start, drawn, wrong, peak_mib());
  std::fflush(stdout);
}

}  // namespace

int main() {
  fmt::print(
      "| case | triangles | frame | lights | ready, s | a frame, s | not finite | peak so far, MiB |\n");
  fmt::print("|---|---|---|---|---|---|---|---|\n");
  draw("plain", 64, 1920, 1080, 2);
  draw("a hundred lights", 64, 1920, 1080, 100);
  draw("a million triangles", 1000, 1920, 1080, 2);
  draw("a large frame", 64, 8192, 8192, 2);
  draw("ten million triangles", 3164, 1920, 1080, 2);
}
