#include "tests/bench/fibres.h"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "converter/stitch/library.h"
#include "converter/stitch/yarn_mesh.h"
#include "tests/converter/load_cell.h"
#include "tests/require.h"

using namespace selvedge;

namespace {

using std::numbers::pi;

/// The integral over the sphere of value(light), by the midpoint rule over sine and azimuth: equal areas.
template <class F>
double over_sphere(const F& value) {
  constexpr int side = 400;
  double sum = 0;
  for (int i = 0; i < side * side; ++i)
    sum += value(HairDirection{2 * (i / side + 0.5) / side - 1, 2 * pi * (i % side + 0.5) / side});
  return sum * 4 * pi / (side * side);
}

}  // namespace

TEST_CASE("a clear fibre sends all light on, and sampling follows a density that integrates to one") {
  for (const double along : {0.15, 0.6}) {
    const HairOptics clear(1.55, along, 0.3, V3d(1, 1, 1));
    for (const double offset : {0.0, -0.9}) {
      const HairBsdf bsdf(clear, 0.4, offset);
      // The narrowest lobe is 0.06 wide along: a step of 1/200 is exact, but where it is cut at a pole.
      CHECK(over_sphere([&](const HairDirection& l) { return bsdf.scattered(l).x; }) ==
            doctest::Approx(1).epsilon(2e-3));
    }
  }
  const HairOptics red(1.55, 0.3, 0.3, V3d(0.6, 0.1, 0.05));
  const HairBsdf bsdf(red, 0.3, 0.6);
  CHECK(over_sphere([&](const HairDirection& l) { return bsdf.density(l); }) ==
        doctest::Approx(1).epsilon(2e-3));
  // Light of (1 + sine)(1 + cos azimuth) tells lobes apart.
  const auto sky = [](const HairDirection& l) { return (1 + l.sine) * (1 + std::cos(l.azimuth)); };
  const double exact = over_sphere([&](const HairDirection& l) { return bsdf.scattered(l).x * sky(l); });
  double sum = 0;
  double square = 0;
  constexpr std::uint32_t count = 1 << 16;
  for (std::uint32_t i = 0; i < count; ++i) {
    PathSampler sampler(i, 3);
    const V2d random = sampler.next_pair();
    const HairDirection l = bsdf.sample(random, sampler.next_pair());
    const double value = bsdf.scattered(l).x / bsdf.density(l) * sky(l);
    sum += value / count;
    square += value * value / count;
  }
  // Independent points would have this standard error; 3.3 of them at 1e-3.
  CHECK(std::abs(sum - exact) < 3.3 * std::sqrt((square - sum * sum) / count));
}

TEST_CASE("a cell of white fibres is white in a white furnace") {
  const auto pattern =
      test::need(find_stitch("plain-knit", of_tubes({{"yarn", {2}}, {"colour", {1, 1, 1}}}))).pattern;
  const CellMesh mesh = test::need(mesh_stitch(pattern));
  const Fibres fibres = lay_fibres(pattern, mesh, 20);
  CHECK(fibres.count() == static_cast<int>(20 * fibres.yarns.size() + mesh.hairs.root_triangles.size()));
  const FibreScene scene(fibres);
  const FibreTracer tracer(scene, fibres.yarns, unlimited_bounces);
  constexpr std::uint32_t count = 4000;
  double sum = 0;
  double square = 0;
  std::uint64_t rays = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    PathSampler sampler(i, 1);
    const V2d at = sampler.next_pair() * scene.period();
    const V3d view = V3d(0.4, -0.3, i % 2 == 0 ? 0.8 : -0.8).normalized();
    FibrePoint point;
    double w = 1;
    if (scene.trace(V3d(at.x, at.y, 0) + view * 40.0, -view, point))
      w = tracer.follow(point, {}, sampler, {}, rays).throughput.x;
    sum += w / count;
    square += (w - 1) * (w - 1) / count;
  }
  // Weights leave 1 only by the Bessel function's 2e-7 and by chance on paths of more than 512 bounces; the
  // normal quantile at 1e-3, two-sided, is 3.3.
  CHECK(std::abs(sum - 1) < 3.3 * std::sqrt(square / count) + 1e-4);
  CHECK(square < 0.1);
  CHECK(rays > 4 * count);
}
