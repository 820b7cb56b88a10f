#include "converter/light/fibre_scene.h"

#include <doctest/doctest.h>

#include <cmath>

#include "converter/light/fibre_tracer.h"
#include "converter/stitch/library.h"
#include "converter/stitch/yarn_mesh.h"
#include "tests/converter/load_cell.h"
#include "tests/require.h"

using namespace selvedge;

namespace {

/// One straight fibre along x, at (y, z) = (0.5, 0), in a cell of 1 x 1 from `x` to x + 1.
Fibres one_fibre(float x, float radius) {
  Fibres fibres;
  for (int k = 0; k <= 4; ++k) fibres.points.emplace_back(x + 0.25F * static_cast<float>(k), 0.5F, 0.0F);
  fibres.first = {0, 5};
  fibres.radius = {radius};
  fibres.yarn = {0};
  fibres.yarns.resize(1);
  return fibres;
}

Fibres fibres_of(const StitchSettings& settings, int each_ply) {
  const auto found = test::need(find_stitch("plain-knit", of_tubes(settings)));
  return test::need(lay_fibres(found.pattern, test::need(mesh_stitch(found.pattern)), {each_ply}));
}

}  // namespace

TEST_CASE("rays meet round fibres in every cell, where they are met from outside") {
  for (const float x : {0.0F, 0.6F, -2.7F}) {
    const auto scene = test::need(FibreScene::create(one_fibre(x, 0.1F), "fibre"));
    constexpr int side = 100;
    int met = 0;
    for (int i = 0; i < side * side; ++i) {
      const int row = i / side;
      const double y = (row + 0.5) / side;
      FibrePoint point;
      if (!scene.trace({(i % side + 0.5) / side + 3, y - 2, 1}, {0, 0, -1}, point)) continue;
      ++met;
      CHECK(std::abs(point.along.x) == doctest::Approx(1));
      CHECK(std::abs(point.offset) == doctest::Approx(std::abs(y - 0.5) / 0.1).epsilon(1e-4));
      CHECK(point.axis.y == doctest::Approx(0.5));
      // Out of it again, any way: nothing is near.
      CHECK_FALSE(scene.occluded(FibreScene::leave(point, {0, 0, -1}), {0, 0, -1}));
      CHECK_FALSE(scene.occluded(FibreScene::leave(point, {1, 0, 0}), {1, 0, 0}));
    }
    CHECK(met == side * side / 5);
    // From within, no fibre is met until the next cell's.
    FibrePoint point;
    CHECK_FALSE(scene.trace({0.5, 0.5, 0}, {0, 0, 1}, point));
    CHECK(scene.trace({0.5, 0.5, 0}, {0, 1, 0}, point));
  }
}

TEST_CASE("light's direction in a fibre's frame is the direction again, and its normal is where it is met") {
  const auto scene = test::need(FibreScene::create(one_fibre(0, 0.1F), "fibre"));
  FibrePoint point;
  REQUIRE(scene.trace({0.4, 0.53, 1}, {0, 0, -1}, point));
  for (const V3d& d : {V3d(0.3, 0.4, 0.5), V3d(-0.3, 0.9, -0.2), V3d(0.1, -0.2, -0.9)}) {
    CHECK((direction_of(point, hair_direction(point, d.normalized())) - d.normalized()).length() < 1e-9);
  }
  CHECK(hair_direction(point, {0, 0, 1}).azimuth == doctest::Approx(0));
  // The normal leans to +y; a smooth surface reflects by twice its angle, asin 0.3, to +y as well.
  const double azimuth = hair_direction(point, {0, 1, 0}).azimuth;
  CHECK(std::signbit(azimuth) != std::signbit(point.offset));
}

TEST_CASE("a cell of white fibres is white in a white furnace") {
  StitchSettings settings{{"yarn", {2}}, {"colour", {1, 1, 1}}};
  const Fibres fibres = fibres_of(settings, 20);
  const auto scene = test::need(FibreScene::create(fibres, "wool"));
  const FibreTracer tracer(scene, fibres.yarns, unlimited_bounces);
  constexpr std::uint32_t count = 4000;
  double sum = 0;
  double square = 0;
  std::uint64_t rays = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    PathSampler sampler(i, 1);
    const V2d at = sampler.next() * scene.period();
    const V3d view = V3d(0.4, -0.3, i % 2 == 0 ? 0.8 : -0.8).normalized();
    FibrePoint point;
    double w = 1;
    if (scene.trace(V3d(at.x, at.y, 0) + view * 40.0, -view, point)) {
      w = tracer.follow(point, {}, sampler, {}, rays).throughput.x;
    }
    sum += w / count;
    square += (w - 1) * (w - 1) / count;
  }
  // Weights leave 1 only by the Bessel function's 2e-7 and by chance on paths of more than 512 bounces; the
  // normal quantile at 1e-3, two-sided, is 3.3.
  CHECK(std::abs(sum - 1) < 3.3 * std::sqrt(square / count) + 1e-4);
  CHECK(square < 0.1);
  CHECK(rays > 4 * count);
}

TEST_CASE("paths of light that are followed one by one find what lamps all around send") {
  // Under a sky of lamps of equal irradiance, next-event estimation sums to what escapes: both estimate the
  // same integral, the first with 64 directions of lamps.
  const Fibres fibres = fibres_of({{"colour", {0.5, 0.5, 0.5}}}, 12);
  const auto scene = test::need(FibreScene::create(fibres, "knit"));
  const FibreTracer tracer(scene, fibres.yarns, unlimited_bounces);
  constexpr int lamps = 64;
  std::vector<V3f> lights;
  for (int i = 0; i < lamps; ++i) {
    const double z = 1 - 2 * (i + 0.5) / lamps;
    const double turn = i * 2.399963229728653;
    lights.emplace_back(V3d(std::sqrt(1 - z * z) * std::cos(turn), std::sqrt(1 - z * z) * std::sin(turn), z));
  }
  constexpr std::uint32_t count = 1500;
  double escaped = 0;
  double lit = 0;
  double square = 0;
  std::uint64_t rays = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    PathSampler sampler(i, 1);
    const V2d at = sampler.next() * scene.period();
    FibrePoint point;
    if (!scene.trace({at.x, at.y, 20}, {0, 0, -1}, point)) continue;
    std::vector<V3d> radiance(lamps, V3d(0, 0, 0));
    const double way = tracer.follow(point, lights, sampler, radiance, rays).throughput.x;
    double all = 0;
    for (const V3d& r : radiance) all += r.x * 4 * std::numbers::pi / lamps;
    escaped += way / count;
    lit += all / count;
    square += (way - all) * (way - all) / count;
  }
  // The standard error of the difference, 3.3 of them at 1e-3, and 1 % for the lamps' places.
  CHECK(std::abs(escaped - lit) < 3.3 * std::sqrt(square / count) + 0.01 * escaped);
  CHECK(std::sqrt(square / count) < 0.05 * escaped);
}
