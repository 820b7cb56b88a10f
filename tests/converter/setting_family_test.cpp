#include "converter/setting_family.h"

#include <doctest/doctest.h>

#include <algorithm>

using namespace selvedge;

namespace {

ExpectedPoint row(int texels, LayerChoice layers, std::uint64_t budget, double bytes, double seconds,
                  double held_out) {
  TradePoint point;
  point.texels = texels;
  point.layers = layers;
  point.budget = budget;
  return {point, bytes, seconds, held_out, 0};
}

}  // namespace

TEST_CASE("between measured budgets decibels are linear in octaves, beyond them they are told with caution") {
  const std::vector<ExpectedPoint> table{row(32, LayerChoice::products, 32768, 32768, 10, 20),
                                         row(32, LayerChoice::products, 131072, 131072, 10, 22)};
  const auto families = families_of(table);
  REQUIRE(families.size() == 1);
  const ExpectedPoint between = expected_at(families[0], 65536);
  CHECK(between.held_out == doctest::Approx(21));
  CHECK(between.bytes == 65536);
  CHECK(between.seconds == 10);
  CHECK(between.point.budget == 65536);
  // 1 dB per octave: half of it above; below twice and then more.
  CHECK(expected_at(families[0], 262144).held_out == doctest::Approx(22.5));
  CHECK(expected_at(families[0], 16384).held_out == doctest::Approx(19 - 2));
  const auto budgets = budgets_of(families[0]);
  CHECK(std::is_sorted(budgets.begin(), budgets.end()));
  CHECK(budgets.front() == 8192);
  CHECK(budgets.back() <= 4 * 131072);
  CHECK(std::find(budgets.begin(), budgets.end(), 131072) != budgets.end());
}

TEST_CASE("what a budget leaves unused no larger one uses") {
  const std::vector<ExpectedPoint> table{row(16, LayerChoice::products, 131072, 80000, 5, 20)};
  const auto families = families_of(table);
  REQUIRE(families.size() == 1);
  CHECK(budgets_of(families[0]).back() == 131072);
  CHECK(expected_at(families[0], 100000).bytes == 80000);
  CHECK(expected_at(families[0], 100000).held_out == 20);
  // No slope is known, so 0.75 dB per octave is taken, below twice as much and more.
  CHECK(expected_at(families[0], 40000).held_out == doctest::Approx(17.75));
}

TEST_CASE(
    "one row alone has the slope of its kind of layers, and settings without a budget stay as they are") {
  const std::vector<ExpectedPoint> table{
      row(16, LayerChoice::slabs, 32768, 32768, 5, 19), row(32, LayerChoice::products, 32768, 32768, 10, 20),
      row(32, LayerChoice::products, 131072, 131072, 10, 22),
      row(64, LayerChoice::products, 131072, 131072, 40, 23), row(64, LayerChoice::paper, 0, 500000, 30, 20)};
  const auto families = families_of(table);
  REQUIRE(families.size() == 5);
  CHECK(held_out_at(families[2], 262144) == doctest::Approx(23.5));
  CHECK(families[0].rise == doctest::Approx(0.375));
  CHECK(budgets_of(families[3]) == std::vector<std::uint64_t>{0});
  CHECK(expected_at(families[3], 0).bytes == 500000);
  // Products at 16 texels follow from those at 32 and 64.
  const SettingFamily& coarser = families[4];
  CHECK(coarser.setting.texels == 16);
  CHECK(coarser.setting.layers == LayerChoice::products);
  REQUIRE(coarser.rows.size() == 2);
  CHECK(coarser.rows[0].point.budget == 16384);
  CHECK(coarser.rows[0].seconds == doctest::Approx(5));
  CHECK(coarser.rows[0].held_out < families[1].rows[0].held_out);
}

TEST_CASE("the model of the measured table is of sense") {
  for (const SettingFamily& family : families_of(expected_points())) {
    CAPTURE(name_of(family.setting));
    CHECK(family.setting.texels >= 8);
    CHECK(family.setting.texels <= 64);
    const auto budgets = budgets_of(family);
    REQUIRE_FALSE(budgets.empty());
    for (const std::uint64_t budget : budgets) {
      const ExpectedPoint expected = expected_at(family, budget);
      CHECK(expected.seconds > 0);
      CHECK(expected.bytes > 0);
      CHECK(expected.held_out > 0);
      CHECK(expected.held_out < 30);
      CHECK(expected.point.budget == budget);
    }
  }
}
