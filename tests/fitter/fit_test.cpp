#include "fitter/fit.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "format/base/parallel.h"
#include "format/base/random.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"
#include "tests/format/fabrics.h"
#include "tests/require.h"

using namespace selvedge;

namespace {

using Radiance = std::function<V3f(int texel, const V3f& light, const V3f& view)>;

SamplesHeader header_of(int width, int height) {
  SamplesHeader header;
  header.width = width;
  header.height = height;
  return header;
}

/// Samples of 64 x 64 directions, everything opaque, normals up.
SampleLevel samples_of(const SamplesHeader& header, const Radiance& radiance) {
  SampleLevel level{.width = header.width,
                    .height = header.height,
                    .views = header.views.count(),
                    .lights = header.lights.count()};
  const auto views = cell_directions(header.views);
  const auto lights = cell_directions(header.lights);
  for (int t = 0; t < header.texels(); ++t) {
    level.normal_sum.emplace_back(0.0F, 0.0F, 64.0F);
    for (const V3f& v : views) {
      level.alpha.push_back(1);
      for (const V3f& l : lights) level.radiance.push_back(radiance(t, l, v));
    }
  }
  return level;
}

Fabric fit_all(SampleLevel level, const SamplesHeader& header, const FitOptions& options = {}) {
  const auto result = test::need(fit(level, header, options));
  const auto valid = fabric_file_bytes(result);
  CHECK_MESSAGE(valid, (valid ? "" : to_line(valid.error())));
  return result;
}

/// Relative L2 of the fit against a function, over random directions.
double error_against(const Fabric& fabric, const Radiance& radiance) {
  double error = 0;
  double energy = 0;
  for (const DirectionPair& pair : random_direction_pairs(500, 0.15, 77)) {
    const V3f truth = radiance(0, pair.light, pair.view);
    error +=
        static_cast<double>((evaluate(fabric, 0, 0, 0, pair.light, pair.view).radiance - truth).length2());
    energy += static_cast<double>(truth.length2());
  }
  return std::sqrt(error / energy);
}

/// Radiance of the fabric's level 0 in these directions.
PairSamples shown_by(const Fabric& fabric, std::vector<DirectionPair> pairs) {
  const FabricLevel& level = fabric.levels.front();
  PairSamples samples{.width = level.width, .height = level.height, .pairs = std::move(pairs)};
  for (const DirectionPair& pair : samples.pairs) {
    for (int t = 0; t < level.texels(); ++t) {
      const Shading s = evaluate(fabric, 0, t % level.width, t / level.width, pair.light, pair.view);
      samples.alpha.push_back(s.alpha);
      samples.radiance.push_back(s.radiance);
    }
  }
  return samples;
}

/// Relative L2 of level 0 over directions that no fit has seen.
double error_of(const Fabric& fabric, const Fabric& truth) {
  const auto pairs = random_direction_pairs(400, 0.05, 99);
  const PairSamples a = shown_by(fabric, pairs);
  const PairSamples b = shown_by(truth, pairs);
  double error = 0;
  double energy = 0;
  for (std::size_t i = 0; i < a.radiance.size(); ++i) {
    error += static_cast<double>((a.radiance[i] - b.radiance[i]).length2());
    energy += static_cast<double>(b.radiance[i].length2());
  }
  return std::sqrt(error / energy);
}

FitOptions options_of(int lobes, bool table) {
  return {.lobes = lobes, .view_table = table, .max_iterations = 200, .tolerance = 1e-12};
}

}  // namespace

TEST_CASE(
    "a Lambert plane comes back as rho = albedo / pi at every level, with and without lobes and table") {
  const SamplesHeader header = header_of(4, 4);
  const V3f rho = V3f(0.2F, 0.5F, 0.9F) / std::numbers::pi_v<float>;
  const Radiance lambert = [&](int, const V3f& l, const V3f&) { return rho * l.z; };
  for (const int lobes : {0, 1, 2, 3}) {
    for (const bool table : {false, true}) {
      FitOptions options{.lobes = lobes, .view_table = table};
      const Fabric result = fit_all(samples_of(header, lambert), header, options);
      CHECK(error_against(result, lambert) < 0.01);
      for (const FabricLevel& level : result.levels) {
        for (std::size_t c = 0; c < 3; ++c) {
          const float found = level.lobes()[c * static_cast<std::size_t>(parameter_count(lobes))];
          CHECK(found == doctest::Approx(rho[static_cast<int>(c)]).epsilon(0.01));
        }
      }
    }
  }
}

TEST_CASE("data made from lobes are fitted to within 2 % in function values") {
  // The parameters are not unique; the function is.
  const Radiance truth = [](int, const V3f& l, const V3f& v) {
    const float base = std::max(0.0F, -0.5F * l.x * v.x - 0.6F * l.y * v.y + 0.9F * l.z * v.z);
    return V3f(0.1F + std::pow(base, 6.0F), 0.2F + 0.5F * std::pow(base, 3.0F), 0.05F) * l.z;
  };
  const SamplesHeader header = header_of(1, 1);
  const Fabric result = fit_all(samples_of(header, truth), header);
  CHECK(error_against(result, truth) < 0.02);
}

TEST_CASE("a factor on the view goes into the table, whose mean is 1") {
  const Radiance truth = [](int, const V3f& l, const V3f& v) {
    return V3f(0.3F, 0.3F, 0.1F) * (l.z * (0.5F + v.z * v.z));
  };
  const SamplesHeader header = header_of(1, 1);
  FitOptions options{.lobes = 0};
  const Fabric with = fit_all(samples_of(header, truth), header, options);
  options.view_table = false;
  const Fabric without = fit_all(samples_of(header, truth), header, options);
  // The rest is the interpolation between 64 views: below 3 % where z >= 0.15.
  CHECK(error_against(with, truth) < 0.05);
  CHECK(error_against(without, truth) > 0.2);
  double mean = 0;
  for (const V3f& t : with.levels[0].view_table()) mean += static_cast<double>(t.x) / 64;
  CHECK(mean == doctest::Approx(1).epsilon(1e-3));
}

TEST_CASE("the table stays near 1 where the lobes are almost dark") {
  // <g, g> and <g, r> per view: the lobes see 1e-4 of the others' cosine in the last one, the data noise.
  TexelSamples samples;
  samples.view_count = 4;
  const std::vector<double> square{2.5, 2.5, 2.5, 2.5e-8};
  const std::vector<double> cross{2.5, 2.5, 2.5, 5e-6};
  std::vector<double> table(4);
  DirectionTableSystem undamped(samples.view_count, samples.grid, 0, 0);
  undamped.factorise(square.data());
  undamped.solve(cross.data(), table.data());
  CHECK(table[3] > 100);
  DirectionTableSystem damped(samples.view_count, samples.grid, 0.05 * 2.5, 0);
  damped.factorise(square.data());
  damped.solve(cross.data(), table.data());
  CHECK(table[0] == doctest::Approx(1));
  CHECK(table[3] == doctest::Approx(1).epsilon(0.01));
}

TEST_CASE("the table solves its normal equations, and holes follow their neighbours") {
  TexelSamples samples;
  samples.grid = {4, 3};
  samples.view_count = 12;
  const double d = 0.1;
  const double s = 0.7;
  std::vector<double> square(12);
  std::vector<double> cross(12);
  for (std::size_t v = 0; v < 12; ++v) {
    square[v] = v == 5 ? 0 : 1 + 0.3 * static_cast<double>(v);
    cross[v] = v == 5 ? 0 : 3 * square[v];
  }
  DirectionTableSystem system(samples.view_count, samples.grid, d, s);
  std::vector<double> table(12);
  system.factorise(square.data());
  system.solve(cross.data(), table.data());
  for (std::size_t v = 0; v < 12; ++v) {
    double derivative = square[v] * table[v] - cross[v] + d * (table[v] - 1);
    const std::size_t column = v % 4;
    if (column > 0) derivative += s * (table[v] - table[v - 1]);
    if (column < 3) derivative += s * (table[v] - table[v + 1]);
    if (v >= 4) derivative += s * (table[v] - table[v - 4]);
    if (v < 8) derivative += s * (table[v] - table[v + 4]);
    CHECK(std::abs(derivative) < 1e-12);
  }
  // The others want 3 and the pull towards 1 is weak.
  CHECK(table[5] > 2.4);
  CHECK(table[5] < 3);
}

TEST_CASE("no lobe exceeds its limit on random samples, under one light and under many") {
  for (const DirectionGrid& lights : {DirectionGrid{1, 1}, DirectionGrid{3, 2}, DirectionGrid{8, 8}}) {
    const TexelDirections directions{cell_directions({8, 8}), cell_directions(lights), {8, 8}};
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      Random random(seed);
      std::vector<float> alpha;
      std::vector<V3f> radiance;
      for (std::size_t v = 0; v < 64; ++v) {
        alpha.push_back(static_cast<float>(random.uniform()));
        for (const V3f& l : directions.lights) {
          // Uneven, so that the dictionary's sums want sizes far apart.
          radiance.emplace_back(static_cast<float>(std::pow(random.uniform(), 6)) * l.z);
        }
      }
      const TexelSamples samples =
          gather_texel(alpha.data(), radiance.data(), directions, {0, 0, 1}, {1, 0, 0});
      FitOptions options{.view_table = false};
      const auto fits = fit_texel(samples, options);
      for (int c = 0; c < 3; ++c) {
        // Without a table the bound is the fit's own.
        ChannelProblem problem(samples, c, options);
        ChannelState far;
        const std::vector<double>& p = fits[c].parameters;
        for (std::size_t i = 1; i + 3 < p.size(); i += 4) {
          const double largest = std::max({std::abs(p[i]), std::abs(p[i + 1]), std::abs(p[i + 2])});
          CHECK(std::pow(largest, p[i + 3]) / samples.scale[c] <= problem.bounds().max_size * (1 + 1e-6));
          if (largest > 0)
            far.shapes.push_back({{p[i] / largest, p[i + 1] / largest, p[i + 2] / largest}, p[i + 3]});
        }
        // A start from beyond the bounds is brought within, with a table as well.
        FitOptions with_table;
        ChannelProblem bounded(samples, c, with_table);
        far.sizes.assign(far.shapes.size() + 1, 50 * bounded.bounds().max_size);
        far.table.assign(samples.view_count, 1);
        bounded.evaluate(far, 3);
        for (std::size_t j = 1; j < far.sizes.size(); ++j) CHECK(far.sizes[j] <= bounded.bounds().max_size);
      }
    }
  }
}

TEST_CASE("normals in every direction near the axes give a valid frame") {
  // A normal rounded to half precision is not quite unit, which shows where it almost lies along x.
  for (int axis = 0; axis < 2; ++axis) {
    for (int step = 0; step < 400; ++step) {
      const double angle = step * 0.01 * std::numbers::pi / 180;
      const auto along = static_cast<float>(std::cos(angle));
      const auto up = static_cast<float>(std::sin(angle));
      SamplesHeader header = header_of(1, 1);
      header.views = header.lights = {1, 1};
      SampleLevel level = samples_of(header, [](int, const V3f& l, const V3f&) { return V3f(0.1F) * l.z; });
      level.normal_sum[0] = axis == 0 ? V3f(along, 0, up) : V3f(0, -along, up);
      fit_all(std::move(level), header);
    }
  }
}

TEST_CASE("one and two threads fit the same fabric") {
  const SamplesHeader header = header_of(3, 2);
  const Radiance truth = [](int t, const V3f& l, const V3f& v) {
    return V3f(0.1F, 0.2F, 0.3F) * (l.z * (1 + static_cast<float>(t) * std::max(0.0F, l.x * v.x)));
  };
  set_thread_limit(1);
  const Fabric one = fit_all(samples_of(header, truth), header);
  set_thread_limit(2);
  const Fabric two = fit_all(samples_of(header, truth), header);
  set_thread_limit(0);
  for (std::size_t k = 0; k < one.levels.size(); ++k) {
    CHECK(one.levels[k][LayerKind::lobes] == two.levels[k][LayerKind::lobes]);
    CHECK(one.levels[k][LayerKind::table] == two.levels[k][LayerKind::table]);
  }
}

TEST_CASE("lobes and table that made the pairs come back from a start that is off") {
  for (const bool table : {false, true}) {
    // One of the random fabrics' lobes alone: with several the least squares have more than one minimum.
    Fabric truth = test::random_fabric(2, 2, {3, 3}, 1, 5);
    truth.levels.resize(1);
    for (std::size_t i = 0; i < truth.levels[0].lobes().size(); i += 5) {
      const float values[] = {0.2F, -0.9F, -0.8F, 0.95F, 4};
      for (std::size_t k = 0; k < 5; ++k)
        truth.levels[0].lobes()[i + k] = values[k] * (1 + 0.05F * static_cast<float>(i % 7) / 7);
    }
    if (!table) truth.levels[0].remove_layer(LayerKind::table);
    Fabric fabric = truth;
    for (float& p : fabric.levels[0].lobes()) p *= 0.9F;
    if (table)
      for (V3f& t : fabric.levels[0].view_table()) t *= 1.1F;
    const double before = error_of(fabric, truth);
    // The penalty holds entries of the table where they were: nearly none here.
    FitOptions options = options_of(1, table);
    options.table.damping = options.table.smoothness = 1e-9;
    refit_to_pairs(fabric, shown_by(truth, random_direction_pairs(500, 0.02, 3)), 64, options);
    CHECK(before > 0.05);
    CHECK(error_of(fabric, truth) < 1e-3);
    // As every fit leaves it: a mean of 1 over the views, weighted by opacity.
    for (int texel = 0; table && texel < 4; ++texel) {
      V3d sum(0, 0, 0);
      double weight = 0;
      for (std::size_t v = 0; v < 9; ++v) {
        const auto opacity = static_cast<double>(fabric.levels[0].opacity()[texel * 9 + v]);
        sum += V3d(fabric.levels[0].view_table()[texel * 9 + v]) * opacity;
        weight += opacity;
      }
      for (int c = 0; c < 3; ++c) CHECK(sum[c] / weight == doctest::Approx(1));
    }
  }
}

TEST_CASE("a fabric that shows its pairs stays as it is, and without pairs nothing is refitted") {
  Fabric fabric = test::random_fabric(2, 2, {3, 3}, 2, 5);
  fabric.levels.resize(1);
  const std::vector<float> lobes(fabric.levels[0].lobes().begin(), fabric.levels[0].lobes().end());
  refit_to_pairs(fabric, PairSamples(), 64, options_of(2, true));
  for (std::size_t i = 0; i < lobes.size(); ++i) CHECK(fabric.levels[0].lobes()[i] == lobes[i]);
  const Fabric truth = fabric;
  refit_to_pairs(fabric, shown_by(truth, random_direction_pairs(300, 0.02, 3)), 64, options_of(2, true));
  CHECK(error_of(fabric, truth) < 1e-5);
}

TEST_CASE("Ceres finds nothing better than the end of a fit to the same samples, in automatic derivatives") {
  // A valley's shadow that turns with the light, gloss, noise: no sum of two lobes.
  const std::vector<V3f> directions = cell_directions({6, 6});
  Random random(1);
  SamplesHeader header;
  header.width = header.height = 1;
  header.views = header.lights = {6, 6};
  SampleLevel level{.width = 1, .height = 1, .views = 36, .lights = 36, .normal_sum = {V3f(0, 0, 1)}};
  level.alpha.assign(36, 1);
  PairSamples pairs{.width = 1, .height = 1};
  pairs.alpha.assign(std::size_t{36} * 36, 1);
  for (const V3f& v : directions) {
    for (const V3f& l : directions) {
      const float gloss = std::pow(std::max(0.0F, (l + v).normalized().z), 30.0F);
      const auto lit = static_cast<float>((l.x > 0.4F ? 0.3 : 1.0) * (1 + 0.1 * random.uniform())) * l.z;
      level.radiance.push_back((V3f(0.3F, 0.2F, 0.1F) * (0.4F + v.z) + V3f(0.2F) * gloss) * lit);
      pairs.pairs.push_back({l, v});
    }
  }
  pairs.radiance = level.radiance;
  const FitOptions options = options_of(2, false);
  Fabric fabric = test::need(fit(level, header, options));
  const auto error = [&] {
    double sum = 0;
    const PairSamples shown = shown_by(fabric, pairs.pairs);
    for (std::size_t i = 0; i < shown.radiance.size(); ++i)
      sum += static_cast<double>((shown.radiance[i] - pairs.radiance[i]).length2());
    return sum;
  };
  const double before = error();
  CHECK(before > 0.1);
  refit_to_pairs(fabric, pairs, 36, options);
  CHECK(error() > 0.99 * before);
}

TEST_CASE("a refit of black, of one pair, of huge and of tiny samples is finite") {
  for (const float scale : {0.0F, 1e-30F, 1.0F, 1e30F}) {
    for (const int count : {1, 200}) {
      Fabric fabric = test::random_fabric(2, 2, {3, 3}, 2, 5);
      PairSamples pairs = shown_by(fabric, random_direction_pairs(count, 0, 3));
      for (V3f& r : pairs.radiance) r *= scale;
      refit_to_pairs(fabric, pairs, 64, options_of(2, true));
      const auto valid = fabric_file_bytes(fabric, {.half_layers = {}});
      CHECK_MESSAGE(valid, (valid ? "" : to_line(valid.error())));
    }
  }
}
