// Yarn that lets light through, against closed forms. Random estimates are tested by Student's t, as in
// bake_light_test.cpp.
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "converter/light/path_tracer.h"
#include "converter/mesh/wall_albedo.h"
#include "converter/stitch/library.h"
#include "converter/stitch/yarn_mesh.h"
#include "format/base/random.h"
#include "tests/converter/load_cell.h"
#include "tests/converter/sky_seen.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::test;

namespace {

constexpr double pi = std::numbers::pi;

RayScene scene_of(const CellMesh& mesh) { return need(RayScene::create(mesh, "test")); }

/// Plies without gloss, fibres and hairs.
CellMesh plies(double transmission, const V3f& albedo) {
  auto found = need(find_stitch("plain-knit", of_tubes({{"plies", {3}}, {"twist_per_mm", {-0.3}}})));
  for (Yarn& yarn : found.pattern.yarns) {
    yarn.transmission = transmission;
    yarn.albedo = albedo;
  }
  return need(mesh_stitch(found.pattern, {32}));
}

}  // namespace

TEST_CASE("a translucent yarn by itself sends away of even light what the albedo of its wall is made for") {
  // 1 - (1 - a)^(1 + gain t^2), in three colours; neighbours 40 mm away fill 1/80 of what it sees.
  StitchPattern pattern{"alone", {4, 40}, {}};
  Yarn yarn{.radius_mm = 0.5,
            .albedo = {0.1F, 0.4F, 0.8F},
            .segments = {{V3d(0, 2, 0), V3d(1, 2, 0), V3d(3, 2, 0), V3d(4, 2, 0)}},
            .transmission = 0.7};
  pattern.yarns = {yarn};
  const RayScene scene = scene_of(need(mesh_stitch(pattern, {240})));
  const PathTracer tracer(scene, unlimited_bounces);
  constexpr std::uint32_t count = 1 << 15;
  V3d sum(0, 0, 0);
  for (std::uint32_t i = 0; i < count; ++i) {
    // Even light on its surface: a path from anywhere on it.
    PathSampler sampler(i, 3);
    const V2d at = sampler.next_pair();
    const double angle = 2 * pi * at.y;
    const V3d out(0, std::cos(angle), std::sin(angle));
    SurfacePoint point;
    REQUIRE(scene.trace(V3d(4 * at.x, 2, 0.5) + out * 0.6, -out, point));
    V3d throughput(1, 1, 1);
    V3d towards = cosine_direction(V3d(point.face_normal), sampler.next_pair());
    for (int depth = 0;; ++depth) {
      const auto next = tracer.continue_path(point, towards, depth, sampler, throughput);
      if (!next) break;
      towards = -*next;
      if (scene.trace(scene.offset_origin(point, *next), *next, point)) continue;
      sum += throughput / count;
      break;
    }
  }
  for (int c = 0; c < 3; ++c) {
    const double exact = 1 - std::pow(1 - static_cast<double>(yarn.albedo[c]),
                                      1 + ply_gain * yarn.transmission * yarn.transmission);
    // Weights in [0, 1] but for roulette: 4 standard errors of at most 1/2; and what neighbours send back.
    CHECK(std::abs(sum[c] - exact) < 4 * 0.5 / std::sqrt(count) + exact / 80);
  }
}

TEST_CASE("plies that let light through are white in a white furnace, from both sides") {
  const RayScene scene = scene_of(plies(0.4, {1, 1, 1}));
  const PathTracer tracer(scene, unlimited_bounces);
  constexpr std::uint32_t count = 1 << 16;
  for (const V3d& view : {V3d(0.3, 0.1, 0.9), V3d(-0.6, 0.5, 0.4), V3d(0.2, -0.3, -0.8)}) {
    const V3d v = view.normalized();
    double sum = 0;
    double square = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
      PathSampler sampler(i, 5);
      const V2d at = sampler.next_pair() * scene.period();
      const double w = sky_seen(scene, tracer, V3d(at.x, at.y, 0) + v * 40.0, -v, sampler);
      sum += w;
      square += w * (w - 1);
    }
    // Only Russian roulette makes noise: the variance is the mean of w^2 - w. The normal quantile at
    // 1e-3 / 3, two-sided, is 3.6. Roulette spares less than one path in 50 at each step.
    CHECK(std::abs(sum / count - 1) < 3.6 * std::sqrt(square) / count);
    CHECK(square / count < 1);
  }
}
