#include "format/quality/compare.h"

#include <doctest/doctest.h>

#include <nlohmann/json.hpp>

#include "tests/format/fabrics.h"
#include "tests/require.h"

using namespace selvedge;
using nlohmann::json;

namespace {

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
