// The light of the bake against closed forms. Random estimates are tested by Student's t: of K independent
// estimates (seeds 1 to K) the mean may differ from the exact value by `bound` standard errors, the quantile
// at which all checks of a case together fail wrongly once in 1,000 (Bonferroni). Seeds are fixed, so a test
// that passes always passes.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "converter/bake/texels.h"
#include "converter/stitch/find_cell.h"
#include "format/base/random.h"
#include "tests/converter/bake_cells.h"
#include "tests/converter/load_cell.h"
#include "tests/converter/sky_seen.h"
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
