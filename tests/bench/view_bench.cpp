// How fast a dressed garment is drawn, what a frame's time is made of, and how fast its fabrics are evaluated
// beside the reference: selvedge-bench-view SCENE.glb ...
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include "format/evaluate.h"
#include "format/fabric_exr.h"
#include "format/gltf_scene.h"
#include "format/parallel.h"
#include "viewer/renderer.h"

namespace {

using namespace selvedge;

template <class T>
T need(Result<T> result) {
  if (!result) {
    std::fprintf(stderr, "selvedge-bench-view: %s\n", to_line(result.error()).c_str());
    std::exit(1);
  }
  return std::move(*result);
}

constexpr int width = 1920;
constexpr int height = 1080;
constexpr int frames = 30;

double wall() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
/// Of all threads, those of the rasteriser included.
double processor() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_nsec) * 1e-9;
}

struct Sample {
  double wall = 0;
  double processor = 0;
  RenderStats stats;
};

double median(std::vector<Sample>& samples, double (*of)(const Sample&)) {
  std::vector<double> values;
  for (const Sample& s : samples) values.push_back(of(s) * 1e3);
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
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

/// Evaluations (one texel under one light) per second.
template <class Body>
double rate(std::size_t blocks, const Body& body) {
  double best = 0;
  for (int repeat = 0; repeat < 12; ++repeat) {
    const double start = wall();
    body();
    best = std::max(best, static_cast<double>(blocks * lane_count * 4) / (wall() - start));
  }
  return best;
}

void evaluate_rates(const Fabric& fabric, const std::string& name) {
  const PackedFabric packed = pack(fabric);
  const std::vector<Lanes> all = make_lanes(fabric);
  std::vector<float> sums(64);
  const auto wide = [&](std::size_t slot) {
    LaneScratch scratch;
    LaneShading sum;
    for (const Lanes& block : all)
      evaluate_lanes(packed, block.texels, block.view, block.lights, scratch, sum);
    sums[slot] = sum.red[0];
  };
  const double scalar = rate(all.size(), [&] {
    V3f sum(0, 0, 0);
    for (const Lanes& block : all) {
      for (std::size_t lane = 0; lane < lane_count; ++lane) {
        const V3f view(block.view.x[lane], block.view.y[lane], block.view.z[lane]);
        for (const LaneTexels& of : block.texels) {
          const int columns = fabric.levels[static_cast<std::size_t>(of.level[lane])].width;
          for (const LaneLight& light : block.lights) {
            const V3f l(light.direction.x[lane], light.direction.y[lane], light.direction.z[lane]);
            sum +=
                evaluate(fabric, of.level[lane], of.texel[lane] % columns, of.texel[lane] / columns, l, view)
                    .radiance;
          }
        }
      }
    }
    sums[0] += sum.x;
  });
  const double one = rate(all.size(), [&] { wide(0); });
  const int threads = thread_count();
  const int tasks = 8 * threads;
  const double many = rate(all.size() * static_cast<std::size_t>(tasks), [&] {
    parallel_for(0, tasks, [&](int i) { wide(static_cast<std::size_t>(i) % sums.size()); });
  });
  fmt::print(
      "  fabric {}: reference {:.1f} M evaluations/s a thread, sixteen at once {:.1f} M/s = {:.1f} x; {} "
      "threads "
      "{:.1f} M/s = {:.2f} x one\n",
      name, scalar / 1e6, one / 1e6, one / scalar, threads, many / 1e6, many / one);
}

void run(const std::string& path, double zoom) {
  const Scene scene = need(read_scene(path));
  std::vector<Fabric> fabrics;
  for (const SceneFabric& source : scene.fabrics)
    fabrics.push_back(
        need(source.path.empty() ? read_fabric(source.bytes, source.name) : read_fabric(source.path)));
  const std::vector<V3d> points = need(world_points(scene));
  RenderOptions options;
  options.width = width;
  options.height = height;
  const auto renderer = need(Renderer::create(scene, fabrics, options));
  Frame frame;
  std::vector<Sample> samples;
  for (int i = -2; i < frames; ++i) {
    CameraOptions view;
    view.zoom = zoom;
    view.azimuth = 0.25 * i;
    const Camera camera = need(make_camera(points, static_cast<double>(width) / height, view));
    options.lights = default_lights(camera);
    Sample sample;
    const double start = wall();
    const double start_processor = processor();
    if (const auto good = renderer->draw(camera, options, frame, sample.stats); !good) std::exit(1);
    sample.wall = wall() - start;
    sample.processor = processor() - start_processor;
    // The first frames compile shaders and touch memory for the first time.
    if (i >= 0) samples.push_back(sample);
  }
  const RenderStats& last = samples.back().stats;
  fmt::print("{} zoom {}: {} triangles, {:.1f} % of the pixels covered, {:.2f} surfaces in each\n", path,
             zoom, last.triangles, 100.0 * static_cast<double>(last.covered_pixels) / (width * height),
             static_cast<double>(last.evaluated_pixels) / static_cast<double>(last.covered_pixels));
  fmt::print(
      "  frame {:6.2f} ms ({:.1f}/s), processor {:6.2f} ms; project {:.2f}, geometry {:.2f}, read back "
      "{:.2f}, "
      "evaluation {:.2f}, filter {:.2f}; evaluation per surface and pixel {:.1f} ns x {} threads\n",
      median(samples, [](const Sample& s) { return s.wall; }),
      1e3 / median(samples, [](const Sample& s) { return s.wall; }),
      median(samples, [](const Sample& s) { return s.processor; }),
      median(samples, [](const Sample& s) { return s.stats.project; }),
      median(samples, [](const Sample& s) { return s.stats.geometry; }),
      median(samples, [](const Sample& s) { return s.stats.read_back; }),
      median(samples, [](const Sample& s) { return s.stats.evaluation; }),
      median(samples, [](const Sample& s) { return s.stats.filter; }),
      1e6 * median(samples, [](const Sample& s) { return s.stats.evaluation; }) /
          static_cast<double>(last.evaluated_pixels),
      thread_count());
  for (std::size_t i = 0; i < fabrics.size(); ++i) evaluate_rates(fabrics[i], scene.fabrics[i].name);
}

}  // namespace

int main(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) run(argv[i], 1.15);
}
