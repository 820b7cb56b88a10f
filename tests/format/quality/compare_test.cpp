#include "format/quality/compare.h"

#include <doctest/doctest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "format/fabric/evaluate.h"
#include "tests/format/fabrics.h"
#include "tests/format/yarn_data.h"
#include "tests/require.h"

using namespace selvedge;
using nlohmann::json;

namespace {

/// A truth that is the same everywhere: `count` random views of 4 x 4 texels, with light at l_z = 1/2.
PairSamples constant_truth(int count, float radiance, float alpha) {
  PairSamples truth{.width = 4, .height = 4, .pairs = random_direction_pairs(count, 0.15, 1)};
  for (DirectionPair& pair : truth.pairs) pair.light = V3f(std::sqrt(0.75F), 0, 0.5F);
  const std::size_t values = static_cast<std::size_t>(count) * 16;
  truth.alpha.assign(values, alpha);
  truth.alpha_noise.assign(values, 0);
  truth.radiance.assign(values, V3f(radiance));
  truth.noise.assign(values, V3f(0, 0, 0));
  return truth;
}

/// The same radiance in every view at l_z = 1/2: without lobes the table and the cosine alone are f.
Fabric constant_fabric(float radiance, float opacity) {
  Fabric fabric = test::lambert_fabric(4, 4, {1, 1, 1});
  for (FabricLevel& level : fabric.levels) {
    level.remove_layer(LayerKind::lobes);
    level.add_layer(LayerKind::table, 3, 2 * radiance);
    level.add_layer(LayerKind::opacity, 1, opacity);
  }
  return fabric;
}

/// Random radiance and opacity for random pairs, of 8 x 8 texels.
PairSamples random_truth(int count, std::uint64_t seed) {
  PairSamples truth{.width = 8, .height = 8, .pairs = random_direction_pairs(count, 0.15, seed)};
  Random random(seed);
  for (int i = 0; i < count * 64; ++i) {
    truth.alpha.push_back(test::uniform(random, 0, 1));
    truth.alpha_noise.push_back(0);
    truth.radiance.emplace_back(test::uniform(random, 0, 1), test::uniform(random, 0, 1),
                                test::uniform(random, 0, 1));
    truth.noise.emplace_back(0.0F, 0.0F, 0.0F);
  }
  return truth;
}

}  // namespace

TEST_CASE("a constant error has the figures that follow by hand") {
  // Truth 0.8 * 0.5 = 0.4 over black, fit 0.5 * 1 = 0.5: error 0.1 everywhere, peak 0.4.
  const auto result =
      test::need(compare(constant_fabric(0.5F, 1), constant_truth(8, 0.8F, 0.5F), PairKind::held_out));
  CHECK(result.peak == doctest::Approx(0.4));
  REQUIRE(result.levels.size() == 3);
  for (const LevelComparison& level : result.levels) {
    CHECK(level.psnr == doctest::Approx(20 * std::log10(0.4 / 0.1)));
    CHECK(level.relative_l2 == doctest::Approx(0.25));
    CHECK(level.relative_bias == doctest::Approx(0.25));
    CHECK(level.alpha_rms == doctest::Approx(0.5));
  }
  CHECK(result.pair_count == 8);
}

TEST_CASE("yarn is compared at every size, by its fraction of a texel") {
  // A straight yarn of radius 1/2 in a repeat of 2: from above it covers a half, its texels all or none.
  Fabric fabric = constant_fabric(0.5F, 1);
  fabric.period_mm = V2f(2, 2);
  fabric.levels[0].set_yarns(std::make_shared<const Yarns>(test::straight(2, 0.5F), V2f(2, 2)));
  PairSamples truth = constant_truth(3, 0, 0.5F);
  for (DirectionPair& pair : truth.pairs) pair.view = V3f(0, 0, 1);
  const auto result = compare_yarn(fabric, truth, 1);
  REQUIRE(result.levels.size() == 3);
  for (const LevelComparison& level : result.levels) CHECK(level.level == -1);
  CHECK(result.levels[0].alpha_rms == doctest::Approx(0.5));
  CHECK(result.levels[2].alpha_rms == doctest::Approx(0));
  // The truth is black: the error is the mean of what the yarn shows.
  double sum = 0;
  for (int y = 0; y < 32; ++y) {
    const Shading s = evaluate(fabric, -1.0, V2d(0.3, (y + 0.5) / 32), truth.pairs[0].light, V3f(0, 0, 1));
    sum += static_cast<double>(s.alpha * s.radiance.x) / 32;
  }
  CHECK(sum > 0.01);
  CHECK(result.pair_count == 3);
  CHECK(-20 * std::log10(sum) == doctest::Approx(result.levels[2].psnr).epsilon(0.01));
}

TEST_CASE("the peak is the truth's 99.9th percentile at level 0, one for all levels") {
  PairSamples truth = constant_truth(125, 0, 1);
  // 2,000 texels of three equal channels: of 6,000 values the 99.9th percentile leaves 6 above, the outliers.
  for (std::size_t i = 0; i < truth.radiance.size(); ++i)
    truth.radiance[i] = V3f(static_cast<float>(i) / 2000);
  truth.radiance[0] = V3f(100);
  truth.radiance[1] = V3f(100);
  const auto result = test::need(compare(constant_fabric(0, 1), truth, PairKind::held_out));
  // The largest of the others is 1,999 / 2,000.
  CHECK(result.peak == doctest::Approx(1999.0 / 2000).epsilon(1e-3));
}

TEST_CASE("independent noise of the truth falls by 6.02 dB with every level") {
  PairSamples truth = constant_truth(2000, 1, 1);
  Random random(3);
  for (V3f& n : truth.noise)
    for (int c = 0; c < 3; ++c) n[c] = test::uniform(random, -1, 1);
  const auto result = test::need(compare(constant_fabric(1, 1), truth, PairKind::held_out));
  // Mean square of a uniform number in [-1, 1] is 1/3: 4.77 dB below the peak of 1. The last level has 6,000
  // values, whose mean square is known to 1.2 %: 0.05 dB; bound: 4 of them.
  CHECK(result.levels[0].noise_psnr == doctest::Approx(4.77).epsilon(0.01));
  CHECK(std::abs(result.levels[1].noise_psnr - result.levels[0].noise_psnr - 6.02) < 0.2);
  CHECK(std::abs(result.levels[2].noise_psnr - result.levels[1].noise_psnr - 6.02) < 0.2);
}

TEST_CASE("an exact fit has 200 dB, and holes count as black") {
  const Fabric fabric = constant_fabric(0.5F, 1);
  PairSamples truth = constant_truth(4, 0.5F, 1);
  CHECK(compare(fabric, truth, PairKind::held_out)->levels[0].psnr == 200);
  for (std::size_t i = 0; i < truth.alpha.size(); i += 2) truth.alpha[i] = 0;
  const auto result = compare(fabric, truth, PairKind::held_out);
  // Half of the texels are off by 0.5, the peak is 0.5: mean square 0.125.
  CHECK(result->levels[0].psnr == doctest::Approx(10 * std::log10(0.25 / 0.125)));
}

TEST_CASE("where nearly all is black the peak is the brightest, and a wrong fit of black has 0 dB") {
  const Fabric grey = constant_fabric(0.1F, 1);
  PairSamples truth = constant_truth(1, 0, 1);
  const auto black = test::need(compare(grey, truth, PairKind::held_out));
  CHECK(black.levels[0].psnr == 0);
  CHECK(black.levels[0].relative_l2 == 1);
  truth.radiance[0].x = 0.25F;
  const auto one = test::need(compare(grey, truth, PairKind::held_out));
  CHECK(one.peak == doctest::Approx(0.25));
  CHECK(one.levels[0].psnr < 20);
}

TEST_CASE("samples of another size are refused, even with as many texels") {
  PairSamples truth = constant_truth(2, 1, 1);
  truth.width = 8;
  truth.height = 2;
  CHECK(test::error_of(compare(constant_fabric(1, 1), truth, PairKind::held_out)).code ==
        Code::fabric_mismatch);
}

TEST_CASE("the accuracy of a fabric has the errors that compare finds") {
  Fabric fabric = test::random_product_fabric(8, 8, {2, 2}, 2, 3);
  const PairSamples held_out = random_truth(5, 1);
  FitRecord record;
  test::need(add_side_accuracy(fabric, held_out, record));
  const Comparison comparison = test::need(compare(fabric, held_out, PairKind::held_out));
  CHECK(record.peak == comparison.peak);
  fabric.side = Side::back;
  test::need(add_side_accuracy(fabric, random_truth(3, 2), record));
  CHECK(record.peak == comparison.peak);  // of the front, for both

  const json read = json::parse(accuracy_json(record));
  CHECK(read["pairs"] == 8);
  CHECK(read["peak"].get<double>() == doctest::Approx(record.peak).epsilon(1e-5));
  for (const Side side : {Side::front, Side::back}) {
    const std::vector<double>& psnr = record.psnr[index_of(side)];
    REQUIRE(read[name_of(side)].size() == psnr.size());
    for (std::size_t k = 0; k < psnr.size(); ++k)
      CHECK(std::abs(read[name_of(side)][k].get<double>() - psnr[k]) <= 0.005);
  }
  CHECK(read["front"].size() == fabric.levels.size());
  CHECK_FALSE(read.contains("through"));
}

TEST_CASE("without held-out pairs there is no record") {
  FitRecord none;
  test::need(add_side_accuracy(test::random_product_fabric(8, 8, {2, 2}, 2, 3), PairSamples(), none));
  CHECK(accuracy_json(none) == "{}");
}
