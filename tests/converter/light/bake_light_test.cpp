// The light of the bake against closed forms. Random estimates are tested by Student's t: of K independent
// estimates (seeds 1 to K) the mean may differ from the exact value by `bound` standard errors, the quantile
// at which all checks of a case together fail wrongly once in 1,000 (Bonferroni). Seeds are fixed, so a test
// that passes always passes.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "converter/bake/texels.h"
#include "converter/light/kept_light.h"
#include "converter/light/path_tracer.h"
#include "converter/mesh/wall_albedo.h"
#include "converter/stitch/find_cell.h"
#include "converter/stitch/library.h"
#include "converter/stitch/yarn_mesh.h"
#include "format/base/random.h"
#include "tests/converter/bake_cells.h"
#include "tests/converter/load_cell.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::test;

namespace {

constexpr double pi = std::numbers::pi;

struct Estimate {
  double mean = 0;
  double error = 0;  // standard error of the mean
};

Estimate estimate_of(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  double mean = 0;
  for (const double v : values) mean += v / n;
  double square = 0;
  for (const double v : values) square += (v - mean) * (v - mean) / (n - 1);
  return {mean, std::sqrt(square / n)};
}

RayScene scene_of(const CellMesh& mesh) { return test::need(RayScene::create(mesh, "test")); }

/// Means over the cell of opacity * radiance (red), one estimate per seed: [light].
std::vector<Estimate> cell_means(const TexelBaker& baker, const V3f& view, std::span<const V3f> lights,
                                 int samples, int seeds) {
  std::vector<std::vector<double>> means(lights.size());
  for (int seed = 1; seed <= seeds; ++seed) {
    NoiseSum ignored;
    const ViewSamples seen =
        baker.bake_view(view, lights, samples, hash64(static_cast<std::uint64_t>(seed)), ignored);
    const std::size_t texels = seen.alpha.size();
    for (std::size_t l = 0; l < means.size(); ++l) {
      double sum = 0;
      for (std::size_t t = 0; t < texels; ++t)
        sum += static_cast<double>(seen.alpha[t] * seen.radiance[l * texels + t].x);
      means[l].push_back(sum / static_cast<double>(texels));
    }
  }
  std::vector<Estimate> estimates;
  for (const auto& m : means) estimates.push_back(estimate_of(m));
  return estimates;
}

/// Fraction of a groove's facet, from the valley up, that cannot be seen from a direction with this height
/// over its run towards the facet.
double hidden(double slope, double rise_over_run) {
  return std::max(0.0, (slope - rise_over_run) / (slope + rise_over_run));
}

/// Plies without gloss, fibres and hairs.
CellMesh plies(double transmission, const V3f& albedo) {
  auto found = need(find_stitch("plain-knit", of_tubes({{"plies", {3}}, {"twist_per_mm", {-0.3}}})));
  for (Yarn& yarn : found.pattern.yarns) {
    yarn.transmission = transmission;
    yarn.albedo = albedo;
  }
  return need(mesh_stitch(found.pattern));
}

/// A white furnace: what a path sees of a sky of radiance 1 all around, from `origin` in `direction`.
double sky_seen(const RayScene& scene, const PathTracer& tracer, const V3d& origin, const V3d& direction,
                PathSampler& sampler) {
  SurfacePoint at;
  if (!scene.trace(origin, direction, at)) return 1;
  V3d towards = -direction;
  V3d throughput(1, 1, 1);
  for (int depth = 0;; ++depth) {
    const auto next = tracer.continue_path(at, towards, depth, sampler, throughput);
    if (!next) return 0;
    if (!tracer.follow(*next, at)) return throughput.x;
    towards = -*next;
  }
}

/// Even light that leaves the curves by way of others, from above or from below.
std::vector<double> light_of_curves(const YarnData& data, const std::vector<float>& light) {
  std::vector<double> sums;
  std::size_t first = 0;
  for (const YarnCurve& curve : data.curves) {
    sums.push_back(0);
    for (int s = 0; s < curve.stations; ++s, first += light_values_per_station)
      for (std::size_t c = 0; c < 3; ++c) sums.back() += static_cast<double>(light[first + c]);
  }
  return sums;
}

}  // namespace

TEST_CASE("grooves mask and shadow as Torrance and Sparrow's do") {
  // Facets of slope t; light and view hide the lower part of a facet, so seen and lit is what the larger of
  // both leaves. Mean over the plane: the facets' areas projected along the view.
  constexpr float slope = 1.5;
  constexpr double albedo = 0.75;
  const RayScene scene = scene_of(groove(2, slope, 0.75F));
  const TexelBaker baker(scene, 0, {4, 1}, 1.5);
  const std::vector<V3f> directions = cell_directions(nearly_square_grid(16));
  const double cosine = 1 / std::sqrt(1 + double{slope} * double{slope});
  for (const V3f& v : directions) {
    const auto means = cell_means(baker, v, directions, 16, 64);
    for (std::size_t l = 0; l < directions.size(); ++l) {
      double exact = 0;
      for (const double side : {1.0, -1.0}) {
        const V3d normal(side * double{slope} * cosine, 0, cosine);
        const auto facing = [&](const V3f& d) { return std::max(0.0, normal.dot(V3d(d))); };
        const auto dark = [&](const V3f& d) {
          const double run = side * static_cast<double>(d.x);
          return run > 0 ? hidden(double{slope}, static_cast<double>(d.z) / run) : 0.0;
        };
        exact += albedo / pi * facing(directions[l]) * facing(v) / (2 * cosine * static_cast<double>(v.z)) *
                 (1 - std::max(dark(directions[l]), dark(v)));
      }
      // Student's t with 63 degrees of freedom at 1e-3 / 256, two-sided: 5.0. Rays leave 4e-5 off the
      // surface, which moves the edge of a shadow by a few of those.
      CHECK(std::abs(means[l].mean - exact) <= 5.0 * means[l].error + 3e-4 * albedo / pi);
    }
  }
}

TEST_CASE("light between two plates is the geometric series of their albedos") {
  // The floor far below a plate with slits of fraction t: light enters through them, and what the floor sends
  // up comes back with the fraction x = (1 - t) a1 a2, again and again. Where light does not fall directly,
  // the floor's irradiance is t lz x / (1 - x).
  constexpr double open = 0.25;
  constexpr double floor_albedo = 0.875;
  constexpr double plate_albedo = 0.625;
  const RayScene scene = scene_of(slit_plate(20, 0.75F, 0.875F, 0.625F));
  // About half a period aside after 20 down: straight from above the slit shows dark floor.
  const V3f light = V3f(0.02625F, 0, 1).normalized();
  const double x = (1 - open) * floor_albedo * plate_albedo;
  const double exact = floor_albedo / pi * open * static_cast<double>(light.z) * x / (1 - x);
  const auto floor_seen = [&](int bounces) {
    const TexelBaker baker(scene, bounces, {4, 1}, 20);
    std::vector<double> means;
    for (std::uint64_t seed = 1; seed <= 64; ++seed) {
      NoiseSum ignored;
      const ViewSamples seen = baker.bake_view({0, 0, 1}, {&light, 1}, 1024, hash64(seed), ignored);
      for (std::size_t t = 0; t < 3; ++t)
        CHECK(static_cast<double>(seen.radiance[t].x) ==
              doctest::Approx(plate_albedo / pi * static_cast<double>(light.z)).epsilon(1e-5));
      means.push_back(static_cast<double>(seen.radiance[3].x));
    }
    return estimate_of(means);
  };
  const Estimate e = floor_seen(unlimited_bounces);
  // t with 63 degrees of freedom at 1e-3, two-sided: 3.46. The floor's light is uneven as the plate sees it
  // by less than (1/20)^2 of itself: the fraction of directions steeper than a period's width.
  CHECK(e.error < 0.01 * exact);
  CHECK(std::abs(e.mean - exact) <= 3.46 * e.error + exact / 400);
  // Two bounces are the first term of the series.
  const Estimate two = floor_seen(2);
  CHECK(std::abs(two.mean - exact * (1 - x)) <= 3.46 * two.error + exact / 400);
}

TEST_CASE("a knit with holes and a weave are white in a white furnace") {
  // Radiance 1 from everywhere, albedo 1: every path that ends in the sky brings 1, and none may get lost.
  // Only Russian roulette makes noise. Where nothing is lost its variance is the mean of w^2 - w over the
  // weights w that arrive (0 from ended paths): steadier than the usual estimate, which rare losses rule.
  constexpr int side = 5;
  constexpr std::uint32_t paths = 4096;
  const std::vector<V3f> views = cell_directions(nearly_square_grid(4));
  for (const char* stitch : {"lace", "satin"}) {
    CAPTURE(stitch);
    auto mesh = test::need(load_cell(stitch));
    std::fill(mesh.albedo.begin(), mesh.albedo.end(), V3f(1, 1, 1));
    for (Gloss& gloss : mesh.gloss) gloss.weight = 0;
    const RayScene scene = scene_of(mesh);
    const PathTracer tracer(scene, unlimited_bounces);
    double total = 0;
    double total_square = 0;
    double worst = 0;
    for (const V3f& v : views) {
      for (int texel = 0; texel < side * side; ++texel) {
        double sum = 0;
        double square = 0;
        for (std::uint32_t i = 0; i < paths; ++i) {
          PathSampler sampler(i, hash64(static_cast<std::uint64_t>(texel)));
          const V2d within = sampler.next_pair();
          const V3d at((texel % side + within.x) / side * mesh.period.x,
                       (texel / side + within.y) / side * mesh.period.y, 0);
          const double w =
              sky_seen(scene, tracer, at + V3d(v) * (20 / static_cast<double>(v.z)), -V3d(v), sampler);
          sum += w;
          square += w * (w - 1);
        }
        total += sum;
        total_square += square;
        worst = std::max(worst, std::abs(sum / paths - 1) / std::sqrt(std::max(square, 1e-3)) * paths);
      }
    }
    // Fewer than 1,000 texels, views and stitches: the normal quantile at 1e-3 / 1000, two-sided, is 4.9;
    // losses are rare, so that the mean is skewed towards them. At 1e-3 / 10 it is 3.9.
    CHECK(worst < 1.2 * 4.9);
    const double count = static_cast<double>(paths) * side * side * static_cast<double>(views.size());
    CHECK(std::abs(total / count - 1) < 3.9 * std::sqrt(total_square) / count);
  }
}

TEST_CASE("a translucent yarn by itself sends away of even light what the albedo of its wall is made for") {
  // 1 - (1 - a)^(1 + gain t^2), in three colours; neighbours 40 mm away fill 1/80 of what it sees.
  StitchPattern pattern{"alone", {4, 40}, {}};
  Yarn yarn{.radius_mm = 0.5,
            .albedo = {0.1F, 0.4F, 0.8F},
            .segments = {{V3d(0, 2, 0), V3d(1, 2, 0), V3d(3, 2, 0), V3d(4, 2, 0)}},
            .transmission = 0.7};
  pattern.yarns = {yarn};
  const RayScene scene = scene_of(need(mesh_stitch(pattern)));
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
      if (tracer.follow(*next, point)) continue;
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

TEST_CASE("light of cloth that is edited in a place is nearly the light of all of it anew") {
  CellOptions options;
  options.form = StitchForm::yarn;
  options.settings = {{"repeats", {8}}};
  const YarnCell cell = test::need(find_cell("plain-knit", options)).yarn.value();
  const V2f period(cell.period);
  const LineLightOptions lines{.both_sides = true};
  YarnData before = cell.yarns;
  compute_yarn_light(before, period, cell.wall_transmission, lines);
  const Yarns last(before, period);
  // A dent of a stitch's size.
  const V2f middle = period / 2;
  YarnData edited = cell.yarns;
  for (V3f& node : edited.nodes) {
    V2f away(node.x - middle.x, node.y - middle.y);
    for (int k = 0; k < 2; ++k) away[k] -= std::round(away[k] / period[k]) * period[k];
    node.z += 1.2F * std::exp(-away.length2() / 4);
  }
  YarnData truth = edited;
  compute_yarn_light(truth, period, cell.wall_transmission, lines);
  REQUIRE(relight_near_changes(edited, period, cell.wall_transmission, last, lines));
  // Rows whose plies turn otherwise, as they are longer, have 4 % more or less light.
  for (const bool below : {false, true}) {
    const auto light = [&](const YarnData& data) {
      return light_of_curves(data, below ? data.light_through : data.station_light);
    };
    const std::vector<double> was = light(before);
    const std::vector<double> is = light(truth);
    const std::vector<double> found = light(edited);
    double largest_change = 0;
    for (std::size_t c = 0; c < is.size(); ++c) {
      CAPTURE(c);
      CHECK(found[c] == doctest::Approx(is[c]).epsilon(0.05));
      largest_change = std::max(largest_change, std::abs(was[c] / is[c] - 1));
    }
    CHECK(largest_change > 0.05);
    CHECK(std::accumulate(found.begin(), found.end(), 0.0) ==
          doctest::Approx(std::accumulate(is.begin(), is.end(), 0.0)).epsilon(0.02));
  }

  // Nothing has changed; all has; the cloth has another size.
  YarnData same = cell.yarns;
  REQUIRE(relight_near_changes(same, period, cell.wall_transmission, last, lines));
  for (std::size_t i = 0; i < same.station_light.size(); ++i)
    REQUIRE(same.station_light[i] == doctest::Approx(before.station_light[i]).epsilon(1e-3));
  YarnData red = cell.yarns;
  for (YarnCurve& curve : red.curves) curve.albedo = V3f(1, 0, 0);
  CHECK_FALSE(relight_near_changes(red, period, cell.wall_transmission, last, lines));
  CHECK_FALSE(relight_near_changes(same, period * 1.01F, cell.wall_transmission, last, lines));
}
