#include "fitter/fit.h"

#include <doctest/doctest.h>

#include <cmath>

#include "format/base/random.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"
#include "tests/format/fabrics.h"
#include "tests/require.h"

using namespace selvedge;

namespace {

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
