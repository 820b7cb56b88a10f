#include "tests/bench/yarn_bench.h"

#include <algorithm>

#include "format/base/parallel.h"
#include "format/fabric/file.h"
#include "format/scene/swatch.h"
#include "viewer/hybrid/yarn_surface.h"
#include "viewer/renderer.h"

namespace selvedge::bench {
namespace {

constexpr V2i size(640, 480);
constexpr int points = 2;    ///< along either side of a pixel
constexpr int repeats = 10;  ///< of which the fastest counts
constexpr std::size_t packets_at_once = 256;

Fabric read(const std::string& file) {
  FabricReader reader = need(FabricReader::open(file));
  return need(reader.read());
}

/// As many points of neighbouring pixels as are traced together, and what is found there.
struct Points {
  V2d uv;
  YarnLanes beside, view, light;
  YarnHits hits;
  std::uint32_t met = 0;
  YarnSurface surface;
  YarnReflection reflection;
};

struct Seconds {
  double view = 0;
  double surface = 0;
  double shadow = 0;
};

/// Adds what the stages take for these points.
void time_stages(const Fabric& fabric, std::vector<Points>& all, Seconds& sum) {
  const Yarns& yarns = *fabric.levels.front().yarns();
  const double start = cpu_seconds();
  for (Points& p : all) p.met = yarns.trace(p.uv, p.beside, fabric.reference_height, p.view, 0xffff, p.hits);
  const double traced = cpu_seconds();
  for (Points& p : all) {
    if (p.met == 0) continue;
    find_surface(yarns, {}, p.hits, p.met, p.view, {}, p.surface);
    reflect(p.surface, p.light, p.view, p.reflection);
  }
  const double reflected = cpu_seconds();
  std::uint32_t hidden = 0;
  for (Points& p : all) {
    const std::uint32_t facing = p.met & p.reflection.facing;
    if (facing != 0) hidden ^= yarns.occluded(p.surface.leave, p.light, facing);
  }
  const double shadowed = cpu_seconds();
  all[0].met ^= hidden >> 16;  // keeps what has no other effect
  sum.view += traced - start;
  sum.surface += reflected - traced;
  sum.shadow += shadowed - reflected;
}

Seconds stages_of(const Fabric& fabric, const SwatchShot& shot) {
  Seconds sum;
  std::vector<Points> all;
  std::size_t lane = 0;
  const V2d pixel(2.0 / shot.width, 2.0 / shot.height);
  const auto flush = [&] {
    if (!all.empty()) time_stages(fabric, all, sum);
    all.clear();
  };
  for (int y = 0; y < shot.height; ++y) {
    for (int x = 0; x < shot.width; ++x) {
      for (int i = 0; i < points * points; ++i) {
        const V2d in_pixel((i % points + 0.5) / points, (i / points + 0.5) / points);
        const auto ray =
            swatch_ray(shot.camera, V2d((x + in_pixel.x) * pixel.x - 1, 1 - (y + in_pixel.y) * pixel.y));
        if (!ray) continue;
        if (lane == 0) all.emplace_back();
        Points& p = all.back();
        const V2d uv = ray->point * 1000.0 / V2d(fabric.period_mm) * V2d(1, -1);
        if (lane == 0) p.uv = uv;
        p.beside.set(lane, V3f(V3d(uv.x - p.uv.x, uv.y - p.uv.y, 0)));
        p.view.set(lane, V3f(ray->view));
        p.light.set(lane, V3f(shot.lights.front().direction));
        lane = (lane + 1) % yarn_lanes;
        if (lane == 0 && all.size() == packets_at_once) flush();
      }
    }
  }
  if (lane == 0) flush();
  return sum;
}

struct Drawn {
  Drawn(const Fabric& fabric, SwatchView view) : fabrics{fabric}, shot(shot_of(fabric, view)) {
    options.width = shot.width;
    options.height = shot.height;
    options.lights = shot.lights;
    options.levels = best_levels;
    options.context = ContextKind::osmesa;
    renderer = need(Renderer::create(swatch_scene(V2d(fabric.period_mm), shot), fabrics, options));
  }
  static SwatchShot shot_of(const Fabric& fabric, SwatchView view) {
    SwatchShot result = swatch_shot(view, V2d(fabric.period_mm), size.x, size.y);
    result.lights.resize(1);
    return result;
  }
  double draw() {
    RenderStats stats;
    const double start = cpu_seconds();
    need(renderer->draw(shot.camera, options, frame, stats));
    return cpu_seconds() - start;
  }
  std::vector<Fabric> fabrics;
  SwatchShot shot;
  RenderOptions options;
  std::unique_ptr<Renderer> renderer;
  Frame frame;
};

}  // namespace

void yarn_points(const std::string& yarn_file, const std::string& layers_file, Rows& rows) {
  const int threads = thread_count();
  set_threads(1);
  const Fabric yarn = read(yarn_file);
  const Fabric layers = read(layers_file);
  fmt::print(
      "{} x {}, one thread, one light, {} x {} points a pixel; ns a point, the fastest of {}\n\n"
      "| | view ray | surface, its light | shadow ray | frame of yarn (ms) | of layers | times "
      "|\n|---|---|---|---|---|---|---|\n",
      size.x, size.y, points, points, repeats);
  for (const SwatchView view : {SwatchView::near, SwatchView::middle, SwatchView::grazing}) {
    Drawn of_yarn(yarn, view);
    Drawn of_layers(layers, view);
    Seconds best{1e9, 1e9, 1e9};
    double yarn_frame = 1e9;
    double layers_frame = 1e9;
    for (int i = 0; i < repeats; ++i) {
      const Seconds now = stages_of(yarn, of_yarn.shot);
      best = {std::min(best.view, now.view), std::min(best.surface, now.surface),
              std::min(best.shadow, now.shadow)};
      yarn_frame = std::min(yarn_frame, of_yarn.draw());
      layers_frame = std::min(layers_frame, of_layers.draw());
    }
    const double ns = 1e9 / (size.x * size.y * points * points);
    fmt::print("| {} | {:.0f} | {:.0f} | {:.0f} | {:.1f} | {:.1f} | {:.2f} |\n", name_of(view),
               best.view * ns, best.surface * ns, best.shadow * ns, yarn_frame * 1e3, layers_frame * 1e3,
               yarn_frame / layers_frame);
    const std::string name = fmt::format("yarn/{}/", name_of(view));
    rows.add(name + "view_ray", best.view * ns, "ns/point");
    rows.add(name + "surface", best.surface * ns, "ns/point");
    rows.add(name + "shadow_ray", best.shadow * ns, "ns/point");
    rows.add(name + "frame", yarn_frame / layers_frame, "x layers");
  }
  fmt::print("\n");
  set_threads(threads);
}

}  // namespace selvedge::bench
