// The error of a bake against a bake of 64 times the samples along paths, beside the error of a plain loop
// over single rays with independent samples: root mean square of opacity * radiance over all texels, views,
// lights and channels, as a fraction of the root mean square of the truth.
//
//   selvedge-bake-noise [STITCH [TEXELS VIEWS LIGHTS]]
#include <fmt/format.h>

#include <chrono>

#include "converter/bake/bake.h"
#include "converter/bake/setup.h"
#include "converter/stitch/find_cell.h"
#include "format/base/parallel.h"
#include "format/base/random.h"
#include "tests/bench/need.h"
#include "tests/converter/load_cell.h"

namespace {

using namespace selvedge;
using bench::need;

/// opacity * radiance: [(texel * views + view) * lights + light].
using Seen = std::vector<V3f>;

Seen baked(const CellMesh& mesh, const BakeOptions& options, BakeReport& report) {
  const Baked baked = need(bake(mesh, "mesh", options));
  report = baked.report;
  SampleLevel level = side_samples(baked.samples, Side::front).level;
  for (std::size_t i = 0; i < level.radiance.size(); ++i)
    level.radiance[i] *= level.alpha[i / static_cast<std::size_t>(options.lights)];
  return std::move(level.radiance);
}

/// Independent samples, a ray at a time: what a bake without ideas does.
Seen plain_loop(const CellMesh& mesh, const BakeOptions& o) {
  const RayScene scene = need(RayScene::create(mesh, "mesh"));
  const PathTracer tracer(scene, o.bounces);
  const std::vector<V3f> views = cell_directions(nearly_square_grid(o.views));
  const std::vector<V3f> lights = cell_directions(nearly_square_grid(o.lights));
  const double plane = plane_height_fraction * static_cast<double>(scene.bounds().max.z);
  Seen seen(static_cast<std::size_t>(o.width * o.height) * views.size() * lights.size(), V3f(0, 0, 0));
  parallel_for(0, o.width * o.height, [&](int texel) {
    for (std::size_t v = 0; v < views.size(); ++v) {
      std::vector<V3d> sum(lights.size(), V3d(0, 0, 0));
      const V3d view(views[v]);
      for (int i = 0; i < o.samples; ++i) {
        Random random(7, static_cast<std::uint64_t>(texel), v, static_cast<std::uint64_t>(i));
        const V3d at((texel % o.width + random.uniform()) / o.width * mesh.period.x,
                     (1 - (texel / o.width + random.uniform()) / o.height) * mesh.period.y, plane);
        SurfacePoint point;
        if (!scene.trace(at + view * (mesh.period.x / view.z), -view, point)) continue;
        const YarnBrdf surface = brdf_at(scene, point);
        for (std::size_t l = 0; l < lights.size(); ++l) {
          const V3d light(lights[l]);
          if (surface.normal.dot(light) <= 0 || scene.is_occluded(point, lights[l])) continue;
          sum[l] += reflectance(surface, light, view) * surface.normal.dot(light);
        }
        PathSampler sampler(0, random.next());
        tracer.add_indirect(point, view, lights, sampler, sum);
      }
      for (std::size_t l = 0; l < lights.size(); ++l)
        seen[(static_cast<std::size_t>(texel) * views.size() + v) * lights.size() + l] =
            V3f(sum[l] / o.samples);
    }
  });
  return seen;
}

double error_of(const Seen& seen, const Seen& truth) {
  double error = 0;
  double signal = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    error += static_cast<double>((seen[i] - truth[i]).length2());
    signal += static_cast<double>(truth[i].length2());
  }
  return std::sqrt(error / signal);
}

}  // namespace

int main(int argc, char** argv) {
  const auto number = [&](int i, int otherwise) { return argc > i ? std::atoi(argv[i]) : otherwise; };
  const auto mesh = need(load_cell(argc > 1 ? argv[1] : "plain-knit"));
  BakeOptions o;
  o.width = o.height = number(2, 32);
  o.views = number(3, 8);
  o.lights = number(4, 16);
  o.held_out_pairs = o.validation_pairs = 0;
  BakeReport report;
  auto lap = [start = std::chrono::steady_clock::now()]() mutable {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - start).count();
    start = now;
    return seconds;
  };
  o.samples = 1024;
  o.seed = 99;
  const Seen truth = baked(mesh, o, report);
  fmt::print("truth: {} samples along paths, {:.1f} s, own noise at most {:.5f}\n", o.samples, lap(),
             report.noise);
  o.samples = 16;
  o.seed = 1;
  const double independent = error_of(plain_loop(mesh, o), truth);
  fmt::print("plain loop, 16 independent samples: error {:.5f}, {:.2f} s\n", independent, lap());
  fmt::print("samples    error  of the loop's  own estimate  seconds\n");
  for (const int samples : {4, 8, 16, 64}) {
    o.samples = samples;
    const double error = error_of(baked(mesh, o, report), truth);
    fmt::print("{:7}  {:.5f}  {:13.2f}  {:12.5f}  {:7.2f}\n", samples, error, error / independent,
               report.noise, lap());
  }
  return 0;
}
