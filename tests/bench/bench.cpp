// Benchmarks of the stages at the paper's scale: 32 x 32 texels, 64 views x 64 lights, 2 lobes, 6 levels. All
// in one run, so that their ratios mean something on a machine that is shared with others.
#include <benchmark/benchmark.h>

#include <array>
#include <atomic>
#include <bit>
#include <cstdio>
#include <filesystem>
#include <string>

#include "converter/bake/bake.h"
#include "converter/light/ray_scene.h"
#include "converter/stitch/find_cell.h"
#include "fitter/fit.h"
#include "format/base/parallel.h"
#include "format/base/random.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"
#include "tests/bench/need.h"
#include "tests/converter/load_cell.h"
#include "tests/format/fabrics.h"

namespace {

using namespace selvedge;
using bench::need;

std::string scratch(const char* name) {
  return (std::filesystem::temp_directory_path() / (std::string("selvedge-bench-") + name)).string();
}

const CellMesh& knit() {
  static const CellMesh mesh = need(load_cell("plain-knit"));
  return mesh;
}

/// The result of bake_knit().
SideSamples& samples_of_knit() {
  static SideSamples samples;
  return samples;
}

void bake_knit(benchmark::State& state) {
  for ([[maybe_unused]] auto _ : state) {
    Baked baked = need(bake(knit(), "plain-knit", BakeOptions{}));
    samples_of_knit() = samples_of(baked.samples, Side::front);
  }
}

/// The ray tracer's rate for the kind of rays that a bake casts most, and nothing else: shadow rays of 16
/// neighbouring points, packet by packet, on all threads.
void trace_shadow_packets(benchmark::State& state) {
  const RayScene scene = need(RayScene::create(knit(), "plain-knit"));
  const std::vector<V3f> directions = directions_of({8, 8});
  std::vector<PointPacket> packets(512);
  std::vector<std::uint32_t> hits;
  Random random(1);
  for (PointPacket& packet : packets) {
    const V3d view(directions[static_cast<std::size_t>(random.uniform() * 64)]);
    const V2d corner(random.uniform() * knit().period.x, random.uniform() * knit().period.y);
    std::array<V3d, packet_size> origins;
    for (V3d& o : origins) {
      o = V3d(corner.x + random.uniform() * knit().period.x / 32,
              corner.y + random.uniform() * knit().period.y / 32, static_cast<double>(scene.bounds().max.z)) +
          view * 10.0;
    }
    hits.push_back(scene.trace(origins, -view, packet));
  }
  std::atomic<std::int64_t> rays{0};
  std::atomic<int> blocked{0};
  for ([[maybe_unused]] auto _ : state) {
    parallel_for(0, 32, [&](int chunk) {
      std::int64_t traced = 0;
      int dark = 0;
      for (std::size_t p = static_cast<std::size_t>(chunk) * 16; p < static_cast<std::size_t>(chunk + 1) * 16;
           ++p) {
        if (hits[p] == 0) continue;
        const LeavingPacket leaving = scene.leave(packets[p], hits[p]);
        for (const V3f& light : directions) {
          std::uint32_t facing = 0;
          for (std::size_t i = 0; i < packet_size; ++i) {
            facing |= (packets[p][i].face_normal.dot(light) > 0 ? 1U : 0U) << i;
          }
          facing &= hits[p];
          traced += std::popcount(facing);
          dark += std::popcount(scene.occluded(leaving, light, facing));
        }
      }
      rays += traced;
      blocked += dark;
    });
  }
  benchmark::DoNotOptimize(blocked.load());
  state.counters["rays_per_s"] = benchmark::Counter(static_cast<double>(rays), benchmark::Counter::kIsRate);
}

/// The rate of the ray tracer alone: the same kind of shadow rays, nothing else, on all threads.
void trace_shadow_rays(benchmark::State& state) {
  const RayScene scene = need(RayScene::create(knit(), "plain-knit"));
  const std::vector<V3f> lights = directions_of({8, 8});
  std::vector<SurfacePoint> points;
  Random random(1);
  while (points.size() < 4096) {
    const V3d from(random.uniform() * knit().period.x, random.uniform() * knit().period.y, 100);
    SurfacePoint point;
    if (scene.trace(from, {0, 0, -1}, point)) points.push_back(point);
  }
  std::atomic<std::int64_t> rays{0};
  std::atomic<int> blocked{0};
  for ([[maybe_unused]] auto _ : state) {
    parallel_for(0, 64, [&](int chunk) {
      std::int64_t traced = 0;
      int hits = 0;
      for (std::size_t i = 0; i < 64; ++i) {
        const SurfacePoint& point = points[static_cast<std::size_t>(chunk) * 64 + i];
        for (const V3f& light : lights) {
          if (point.face_normal.dot(light) <= 0) continue;
          ++traced;
          hits += scene.occluded(point, light) ? 1 : 0;
        }
      }
      rays += traced;
      blocked += hits;
    });
  }
  benchmark::DoNotOptimize(blocked.load());
  state.counters["rays_per_s"] = benchmark::Counter(static_cast<double>(rays), benchmark::Counter::kIsRate);
}

void fit_knit(benchmark::State& state) {
  const SideSamples& samples = samples_of_knit();
  for ([[maybe_unused]] auto _ : state) {
    const FitResult result = need(fit(samples.level, samples.header, FitOptions{}));
    state.PauseTiming();
    if (auto ok = write_fabric(scratch("fabric.exr"), result.fabric); !ok) std::exit(1);
    state.ResumeTiming();
  }
  state.counters["bytes"] = static_cast<double>(std::filesystem::file_size(scratch("fabric.exr")));
}

void read_knit(benchmark::State& state) {
  for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(need(read_fabric(scratch("fabric.exr"))));
}

/// A fabric of 128 x 128 texels and 64 views with all layers on all levels, of random numbers.
const std::string& large_fabric() {
  static const std::string path = [] {
    std::string written = scratch("large.exr");
    if (!write_fabric(written, test::random_fabric(128, 128, {8, 8}, 2, 1))) std::exit(1);
    return written;
  }();
  return path;
}

void read_large(benchmark::State& state) {
  const std::string& path = large_fabric();
  for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(need(read_fabric(path)));
}

/// One evaluation of all three channels on one thread: range(0) = 0 without table and opacity, 1 with.
void evaluate_knit(benchmark::State& state) {
  Fabric fabric = need(read_fabric(scratch("fabric.exr")));
  if (state.range(0) == 0) {
    fabric.levels[0].remove(LayerKind::table);
    fabric.levels[0].remove(LayerKind::opacity);
  }
  const std::vector<DirectionPair> pairs = random_pairs(1024, 0.05, 1);
  int i = 0;
  for ([[maybe_unused]] auto _ : state) {
    const DirectionPair& pair = pairs[i % 1024];
    benchmark::DoNotOptimize(evaluate(fabric, 0, i % 32, (i / 32) % 32, pair.light, pair.view));
    ++i;
  }
  state.counters["evaluations_per_s"] =
      benchmark::Counter(static_cast<double>(i), benchmark::Counter::kIsRate);
}

// In this order: each uses the file of the one before.
BENCHMARK(bake_knit)->Unit(benchmark::kSecond)->UseRealTime()->Iterations(1);
BENCHMARK(trace_shadow_packets)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(trace_shadow_rays)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(fit_knit)->Unit(benchmark::kSecond)->UseRealTime()->Iterations(1);
BENCHMARK(read_knit)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(read_large)->Unit(benchmark::kMillisecond);
BENCHMARK(evaluate_knit)->Arg(0)->Arg(1)->Unit(benchmark::kNanosecond);

}  // namespace

BENCHMARK_MAIN();
