#include "converter/presets/setting_family.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

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

TEST_CASE("the model of the measured table meets its rows, never leaps, and is monotone where they are") {
  for (const SettingFamily& family : families_of(expected_points())) {
    CAPTURE(name_of(family.setting));
    CHECK(family.setting.texels >= 8);
    CHECK(family.setting.texels <= 64);
    const auto& rows = family.rows;
    double steepest = family.fall * (1 + 2);  // at two octaves below the first row, where budgets end
    bool rises = true;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      CAPTURE(rows[i].point.budget);
      CHECK(expected_at(family, rows[i].point.budget).held_out == rows[i].held_out);
      // Both pieces that end at a row end at its decibels.
      for (const double beside : {1 - 1e-9, 1.0, 1 + 1e-9})
        CHECK(held_out_at(family, rows[i].bytes * beside) == doctest::Approx(rows[i].held_out).epsilon(1e-7));
      if (i == 0) continue;
      const double slope =
          (rows[i].held_out - rows[i - 1].held_out) / std::log2(rows[i].bytes / rows[i - 1].bytes);
      steepest = std::max(steepest, std::abs(slope));
      rises = rises && slope >= 0;
      // Halfway between two rows in octaves lies the mean of both.
      CHECK(held_out_at(family, std::sqrt(rows[i].bytes * rows[i - 1].bytes)) ==
            doctest::Approx((rows[i].held_out + rows[i - 1].held_out) / 2));
    }
    ExpectedPoint before;
    for (const std::uint64_t budget : budgets_of(family)) {
      CAPTURE(budget);
      const ExpectedPoint expected = expected_at(family, budget);
      CHECK(expected.point.budget == budget);
      const auto is_row = [&](const ExpectedPoint& row) { return row.point.budget == budget; };
      // A row has what was measured, which may be a little less than its budget.
      if (std::any_of(rows.begin(), rows.end(), is_row)) continue;
      CHECK(expected.seconds == rows.front().seconds);
      CHECK(expected.bytes > 0);
      CHECK(expected.bytes <= static_cast<double>(budget));
      if (before.bytes > 0) {
        CHECK(expected.bytes >= before.bytes);
        const double octaves = std::log2(expected.bytes / before.bytes);
        CHECK(std::abs(expected.held_out - before.held_out) <= steepest * octaves + 1e-9);
        if (rises) CHECK(expected.held_out >= before.held_out - 1e-9);
      }
      before = expected;
    }
  }
}
