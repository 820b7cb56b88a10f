// Random lights against their density and against the integral of f: chi-square tests as in Mitsuba and
// pbrt, over fabrics, levels and views.
#include "format/fabric/light_sampler.h"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"
#include "tests/format/fabric_sides.h"
#include "tests/require.h"

using namespace selvedge;

namespace {

constexpr double pi = std::numbers::pi;

/// The sphere in bins of equal solid angle: rows of z, columns of azimuth.
constexpr int rows = 20;
constexpr int columns = 36;
constexpr double bin = 4 * pi / (rows * columns);

int bin_of(const V3f& light) {
  const double angle = std::atan2(light.y, light.x) / (2 * pi);
  const double row = (1 + static_cast<double>(light.z)) / 2 * rows;
  const double column = (angle < 0 ? angle + 1 : angle) * columns;
  return std::min(static_cast<int>(row), rows - 1) * columns +
         std::min(static_cast<int>(column), columns - 1);
}

/// The density, and f of each colour over its integral as the samples have it.
using Values = std::array<double, 4>;

/// The mean over a bin, of one random point in each of 16 x 16 parts of it: cells, shadows and horizons have
/// edges, at which rules for smooth functions fail.
template <class F>
Values mean_over_bin(const F& f, int row, int column) {
  constexpr int parts = 16;
  Random random(1, row, column);
  Values sum{};
  for (int part = 0; part < parts * parts; ++part) {
    const double z = row + (part / parts + random.uniform()) / parts;
    const double angle = column + (part % parts + random.uniform()) / parts;
    const Values at = f(test::direction_at(2 * z / rows - 1, 2 * pi * angle / columns));
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += at[i] / (parts * parts);
  }
  return sum;
}

/// Standard error of the integral over the sphere that it leaves, relative, at most: measured over the places
/// of this file, whose densities have an integral of 1.
constexpr double integral_error = 1e-4;

/// P(chi-square >= x) of `freedom` degrees: the cube root is nearly normal (Wilson and Hilferty 1931); at 30
/// and more degrees good to a tenth of the probability down to 1e-5.
double chi_square_tail(double x, double freedom) {
  const double v = 2 / (9 * freedom);
  return std::erfc((std::cbrt(x / freedom) - (1 - v)) / std::sqrt(2 * v)) / 2;
}

/// Probability of so large a difference between counts and what is expected; bins of less than 5 are pooled.
double chi_square(const std::vector<int>& counts, const std::vector<double>& expected) {
  double sum = 0;
  double pooled = 0;
  double pooled_count = 0;
  int bins = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (expected[i] < 5) {
      pooled += expected[i];
      pooled_count += counts[i];
      continue;
    }
    sum += (counts[i] - expected[i]) * (counts[i] - expected[i]) / expected[i];
    ++bins;
  }
  if (pooled > 0) {
    sum += (pooled_count - pooled) * (pooled_count - pooled) / pooled;
    ++bins;
  }
  return chi_square_tail(sum, bins - 1);
}

struct Place {
  double level;
  V2d uv;
  V3f view;
};

constexpr int samples = 100000;
constexpr int all_tests = 200;  ///< at least the tests of this file

void check_place(const Fabric& fabric, const Place& place, std::uint64_t seed) {
  CAPTURE(place.level);
  CAPTURE(place.view);
  const LightSampler sampler(fabric, place.level, place.uv, place.view);
  std::vector<int> counts(std::size_t{rows} * columns);
  V3d sum(0, 0, 0);
  V3d squares(0, 0, 0);
  Random random(seed);
  for (int i = 0; i < samples; ++i) {
    const double a = random.uniform();
    const double b = random.uniform();
    const LightSample s = sampler.sample({a, b, random.uniform()});
    ++counts[bin_of(s.light)];
    const V3d weight(s.weight);
    sum += weight;
    squares += weight * weight;
    // As two programs would have them, one in a thousand.
    if (i % 1000 != 0) continue;
    CHECK(s.light.length() == doctest::Approx(1).epsilon(1e-6));
    CHECK(s.pdf == sampler.pdf(s.light));
    const Shading f = evaluate(fabric, place.level, place.uv, s.light, place.view);
    CHECK(s.alpha == f.alpha);
    for (int c = 0; c < 3; ++c) CHECK(s.weight[c] * s.pdf == doctest::Approx(f.radiance[c]).epsilon(1e-6));
  }
  const V3d mean = sum / samples;
  const auto values = [&](const V3f& light) {
    const V3d f(evaluate(fabric, place.level, place.uv, light, place.view).radiance);
    Values all{static_cast<double>(sampler.pdf(light))};
    for (int c = 0; c < 3; ++c) all[static_cast<std::size_t>(c) + 1] = mean[c] > 0 ? f[c] / mean[c] : f[c];
    return all;
  };
  std::vector<double> expected;
  Values whole{};
  for (int i = 0; i < rows * columns; ++i) {
    const Values in_bin = mean_over_bin(values, i / columns, i % columns);
    expected.push_back(in_bin[0] * bin * samples);
    for (std::size_t k = 0; k < whole.size(); ++k) whole[k] += in_bin[k] * bin;
  }
  CHECK(std::abs(whole[0] - 1) < 4 * integral_error);
  // Sidak's level for all of them together: 1 %.
  CHECK(chi_square(counts, expected) > 1 - std::pow(0.99, 1.0 / all_tests));
  for (int c = 0; c < 3; ++c) {
    const double error = std::sqrt(std::max(0.0, squares[c] / samples - mean[c] * mean[c]) / samples);
    CAPTURE(mean[c]);
    CAPTURE(error);
    if (mean[c] > 0)
      CHECK(std::abs(whole[c + 1] - 1) < 4 * std::hypot(error / mean[c], integral_error));
    else
      CHECK(whole[c + 1] == 0);
  }
}

const V3f slanted = V3f(0.5F, -0.4F, 0.7F).normalized();
const V3f grazing = V3f(-0.7F, 0.7F, 0.04F).normalized();

/// Levels, places and views, one after the other: each level with each view.
void check_fabric(const Fabric& fabric, const std::vector<double>& levels, std::uint64_t seed) {
  for (const double level : levels) {
    for (const V3f& view : {V3f(0, 0, 1), slanted, grazing}) {
      Random random(seed++);
      const double u = random.uniform();
      // Where something is seen: else there is nothing to draw.
      V2d uv(u, random.uniform());
      while (evaluate(fabric, level, uv, view, view).alpha == 0) uv.x += 0.07;
      check_place(fabric, {level, uv, view}, seed);
    }
  }
}

Fabric kept(const char* name) {
  return test::need(read_fabric(std::string(SELVEDGE_SOURCE_DIR "/tests/data/kept/4.0/") + name));
}

/// Its yarn reflects a fraction in highlights.
Fabric glossy(Fabric fabric) {
  YarnData data = fabric.levels.front().yarns()->data();
  for (YarnCurve& curve : data.curves) {
    curve.gloss = {0.6F, 0.25F};
    curve.fibre_slope = 0.4F;
  }
  fabric.levels.front().set_yarns(std::make_shared<const Yarns>(std::move(data), fabric.period_mm));
  return fabric;
}

}  // namespace

TEST_CASE("chi-square has the tail of its tables") {
  // Abramowitz and Stegun, table 26.8.
  CHECK(chi_square_tail(59.703, 30) == doctest::Approx(0.001).epsilon(0.02));
  CHECK(chi_square_tail(124.342, 100) == doctest::Approx(0.05).epsilon(0.01));
  CHECK(chi_square_tail(149.449, 100) == doctest::Approx(0.001).epsilon(0.02));
}

TEST_CASE("lights of lobes, tilted texels and tables are drawn as their density says") {
  check_fabric(test::lambert_fabric(2, 2, {0.2F, 0.5F, 0.8F}), {0}, 1);
  check_fabric(test::random_fabric(5, 4, {3, 3}, 2, 11), {0, 0.4, 2}, 2);
}

TEST_CASE("lights of light tables and products are drawn as their density says") {
  Fabric fabric = test::random_product_fabric(6, 4, {2, 3}, 2, 12);
  check_fabric(fabric, {0, 0.7, 1}, 40);
  // Without frames, cells are the cosine's.
  for (const LayerKind kind : {LayerKind::frame, LayerKind::lobes}) fabric.levels[0].remove_layer(kind);
  check_fabric(fabric, {0, 0.7}, 50);
}

TEST_CASE("lights on both sides of the cloth are drawn as their density says, from both sides") {
  const Fabric fabric = test::four_sides();
  check_fabric(fabric, {0, 1.3}, 60);
  check_fabric(turned_over(fabric), {0, 1.3}, 70);
}

TEST_CASE("lights of the yarn itself are drawn as their density says, with gloss and between levels") {
  const Fabric fabric = glossy(test::with_strands(test::four_sides()));
  check_fabric(fabric, {-1, -0.5}, 80);
  check_fabric(turned_over(fabric), {-1}, 90);
}

TEST_CASE("extreme numbers give finite weights, and black texels densities") {
  Random random(7);
  const std::array odd{0.0F, 1e-30F, 1.0F, 30.0F, 1e6F, 3e38F};
  const auto pick = [&] { return odd[static_cast<std::size_t>(random.uniform() * odd.size())]; };
  Fabric fabric = test::random_product_fabric(8, 8, {2, 3}, 3, 1);
  FabricLevel& level = fabric.levels.front();
  for (float& value : level.lobes()) value = random.uniform() < 0.5 ? pick() : value;
  for (V3f& value : level.view_table()) value = random.uniform() < 0.3 ? V3f(pick()) : value;
  for (V3f& value : level.light_table()) value = random.uniform() < 0.3 ? V3f(0, 0, 0) : value;
  level.frame()[3] = {V3f(0, 0, 0), V3f(0, 0, 0)};
  int drawn = 0;
  for (const float z : {1.0F, 0.3F, 1e-3F, 1e-20F, 0.0F, -0.5F}) {
    const V3f view = test::direction_at(static_cast<double>(z), 1);
    for (int i = 0; i < 2000; ++i) {
      const V2d uv(random.uniform(), random.uniform());
      const LightSampler sampler(fabric, i % 3 * 0.5, uv, view);
      // The corners of the cube as well.
      const auto number = [&] { return random.uniform() < 0.1 ? 0.0 : random.uniform(); };
      const double a = number();
      const LightSample s = sampler.sample({a, i % 7 == 0 ? std::nextafter(1.0, 0.0) : number(), number()});
      REQUIRE(std::isfinite(s.pdf));
      REQUIRE(s.pdf >= 0);
      REQUIRE(s.light.length() == doctest::Approx(1).epsilon(1e-5));
      for (int c = 0; c < 3; ++c) REQUIRE((std::isfinite(s.weight[c]) && s.weight[c] >= 0));
      drawn += s.pdf > 0 ? 1 : 0;
      if (z <= 0) REQUIRE(s.pdf == 0);
      // Wherever f is positive, so is the density.
      const V3f light = test::direction_at(random.uniform(), 6.28 * random.uniform());
      if (evaluate(fabric, i % 3 * 0.5, uv, light, view).radiance != V3f(0, 0, 0))
        REQUIRE(sampler.pdf(light) > 0);
    }
  }
  CHECK(drawn > 6000);
  const Fabric dark = test::lambert_fabric(1, 1, {0, 0, 0});
  const LightSample s = LightSampler(dark, 0, {0, 0}, slanted).sample({0.5, 0.5, 0.5});
  CHECK(s.pdf == doctest::Approx(static_cast<double>(s.light.z) / pi));
  CHECK(s.weight == V3f(0, 0, 0));
}

TEST_CASE("weights are bounded: no light has much more than the cloth reflects") {
  const Fabric fabric = kept("lobes.fabric.exr");
  Random random(9);
  for (int i = 0; i < 20000; ++i) {
    const double z = i % 2 == 0 ? 0.02 : 0.6;
    const V2d uv(random.uniform(), random.uniform());
    const double a = random.uniform();
    const double b = random.uniform();
    const LightSample s = LightSampler(fabric, 0, uv, test::direction_at(z, 6.28 * random.uniform()))
                              .sample({a, b, random.uniform()});
    // An albedo of 1 drawn by the floor alone would weigh 10.
    for (int c = 0; c < 3; ++c) CHECK(s.weight[c] < 10);
  }
}
