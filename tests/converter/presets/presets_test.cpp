#include "converter/presets/presets.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "converter/presets/make_within.h"

using namespace selvedge;

namespace {

/// The row of the table; its end where there is none.
const ExpectedPoint* row_of(const TradePoint& point) {
  for (const ExpectedPoint& row : expected_points()) {
    if (row.point == point) return &row;
  }
  return nullptr;
}

// Runs of the same setting differ by so much: times by what else a machine does, pictures and bytes by what
// another seed makes of them. The same as in tests/bench/make_presets.mjs.
constexpr double noise_of_seconds = 0.1;
constexpr double noise_of_pictures = 0.05;
constexpr double noise_of_bytes = 0.01;

/// Whether `a` beats `b`: no worse in anything beyond the noise, and better in something beyond it.
bool beats(const ExpectedPoint& a, const ExpectedPoint& b) {
  const bool no_worse = a.bytes <= b.bytes * (1 + noise_of_bytes) &&
                        a.seconds <= b.seconds * (1 + noise_of_seconds) &&
                        a.pictures >= b.pictures - noise_of_pictures;
  const bool better = a.bytes < b.bytes * (1 - noise_of_bytes) ||
                      a.seconds < b.seconds * (1 - noise_of_seconds) ||
                      a.pictures > b.pictures + noise_of_pictures;
  return no_worse && better;
}

/// A table of three settings: cheap, middling, dear.
std::vector<ExpectedPoint> small_table() {
  std::vector<ExpectedPoint> table(3);
  for (int i = 0; i < 3; ++i) table[i].point.texels = 8 << i;
  table[0] = {table[0].point, 1000, 2, 20, 0};
  table[1] = {table[1].point, 4000, 8, 22, 0};
  table[2] = {table[2].point, 16000, 32, 24, 0};
  return table;
}

/// What a stitch comes to that has 1 dB less, twice the bytes and a machine half as fast on one thread.
Result<MakeFigures> made_of(const TradePoint& point) {
  for (const ExpectedPoint& row : small_table()) {
    if (row.point == point) return MakeFigures{2 * row.bytes, 2 * row.seconds, row.held_out - 1};
  }
  FAIL("a setting that is not in the table");
  return MakeFigures{};
}

}  // namespace

TEST_CASE("every preset is a point of the measured grid, each better and dearer than the one before") {
  const ExpectedPoint* before = nullptr;
  for (const std::string_view name : quality_names) {
    CAPTURE(name);
    const ExpectedPoint* row = row_of(point_of(*quality_named(name)));
    REQUIRE(row != nullptr);
    if (before != nullptr) {
      CHECK(row->pictures > before->pictures + noise_of_pictures);
      CHECK(row->seconds > before->seconds);
    }
    before = row;
  }
  CHECK_FALSE(quality_named("best"));
}

TEST_CASE("no preset is beaten by any point of the measured grid beyond the noise") {
  REQUIRE(expected_points().size() > 20);
  for (const std::string_view name : quality_names) {
    const ExpectedPoint* preset = row_of(point_of(*quality_named(name)));
    REQUIRE(preset != nullptr);
    for (const ExpectedPoint& row : expected_points()) {
      CHECK_MESSAGE(!beats(row, *preset), name, " by ", name_of(row.point));
    }
  }
}

TEST_CASE("within limits the cheapest setting is found whose quality is enough, whatever the stitch") {
  MakeLimits limits;
  limits.held_out = 20.5;
  limits.bytes = 10000;
  const auto chosen = choose_within(small_table(), limits, 1, 1, made_of);
  REQUIRE(chosen);
  // The cheapest comes to 19 dB; the next is then expected to come to 21, and does.
  REQUIRE(chosen->kept);
  REQUIRE(chosen->tried.size() == 2);
  const MadePoint& kept = chosen->tried[*chosen->kept];
  CHECK(kept.point.texels == 16);
  CHECK(kept.expected.held_out == 21);
  CHECK(kept.expected.bytes == 8000);
  CHECK(kept.expected.seconds == 16);
  CHECK(kept.made.bytes == 8000);
}

TEST_CASE("without a least quality the best setting within the limits is made") {
  MakeLimits limits;
  limits.bytes = 9000;
  limits.seconds = 20;
  const auto chosen = choose_within(small_table(), limits, 1, 1, made_of);
  REQUIRE(chosen);
  REQUIRE(chosen->kept);
  CHECK(chosen->tried[*chosen->kept].point.texels == 16);
  // The first that is made may be the best there is.
  limits.seconds = 5;
  const auto first = choose_within(small_table(), limits, 1, 1, made_of);
  REQUIRE(first);
  REQUIRE(first->kept);
  CHECK(first->tried.size() == 1);
}

TEST_CASE("limits that are not to be had together end with the nearest setting") {
  MakeLimits limits;
  limits.held_out = 22.5;
  limits.bytes = 16000;
  const auto chosen = choose_within(small_table(), limits, 1, 1, made_of);
  REQUIRE(chosen);
  CHECK_FALSE(chosen->kept);
  // The dearest has 23 dB but is an octave too large; of what is small enough the middling lacks the least.
  CHECK(chosen->nearest.texels == 16);
  CHECK(chosen->nearest_made);
  CHECK(chosen->nearest_figures.bytes == 8000);
  CHECK(shortfall_of(limits, chosen->nearest_figures).octaves == 0);
  CHECK(shortfall_of(limits, chosen->nearest_figures).decibels == doctest::Approx(1.5));
}

TEST_CASE("an error while a setting is made ends the search") {
  MakeLimits limits;
  limits.seconds = 100;
  const auto chosen =
      choose_within(small_table(), limits, 1, 1, [](const TradePoint&) -> Result<MakeFigures> {
        return tl::unexpected(Error{Code::file_unwritable, "x", "", "full"});
      });
  REQUIRE_FALSE(chosen);
  CHECK(chosen.error().code == Code::file_unwritable);
}

namespace {

/// Slabs at two budgets, and lobes with a table, which cost less time and are worse.
std::vector<ExpectedPoint> table_with_budgets() {
  std::vector<ExpectedPoint> table(3);
  for (ExpectedPoint& row : table) row.point.layers = LayerChoice::slabs;
  table[0].point.layers = LayerChoice::paper;
  table[1].point.budget = 32768;
  table[2].point.budget = 131072;
  table[0] = {table[0].point, 100000, 2, 17, 0};
  table[1] = {table[1].point, 32768, 8, 20, 0};
  table[2] = {table[2].point, 131072, 8, 22, 0};
  return table;
}

/// A stitch that is worse than the table by 1 dB, whose lobes take three times the bytes, and of which
/// nothing is smaller than 12,000 bytes.
Result<MakeFigures> made_with_budgets(const TradePoint& point) {
  if (point.layers == LayerChoice::paper) return MakeFigures{300000, 2, 16};
  const double bytes = std::max(static_cast<double>(point.budget) - 10, 12000.0);
  return MakeFigures{bytes, 8, 20 + std::log2(bytes / 32768) - 1};
}

}  // namespace

TEST_CASE("within a size that nobody measured, layers are chosen within it") {
  MakeLimits limits;
  limits.bytes = 70000;
  const auto chosen = choose_within(table_with_budgets(), limits, 1, 1, made_with_budgets);
  REQUIRE(chosen);
  REQUIRE(chosen->kept);
  CHECK(chosen->tried.size() == 1);
  const MadePoint& kept = chosen->tried[*chosen->kept];
  CHECK(kept.point.budget == 70000);
  CHECK(kept.expected.bytes == 70000);
  // Smaller than any of the table.
  limits.bytes = 20000;
  const auto small = choose_within(table_with_budgets(), limits, 1, 1, made_with_budgets);
  REQUIRE(small);
  REQUIRE(small->kept);
  CHECK(small->tried[*small->kept].made.bytes == 19990);
}

TEST_CASE("a least quality between two measured settings is met with as few bytes as it takes") {
  MakeLimits limits;
  limits.held_out = 20;
  const auto chosen = choose_within(table_with_budgets(), limits, 1, 1, made_with_budgets);
  REQUIRE(chosen);
  REQUIRE(chosen->kept);
  const MadePoint& kept = chosen->tried[*chosen->kept];
  // 20 dB are at 65,536 bytes, for the stitch is 1 dB worse; an eighth of an octave is 9 %.
  CHECK(kept.made.held_out >= 20);
  CHECK(kept.made.bytes < 1.1 * 65536);
  // The lobes had three times the bytes; a budget is kept whatever they have.
  CHECK(kept.expected.bytes == static_cast<double>(kept.point.budget));
  // Beyond the dearest: the rise is taken for half of what it is.
  limits.held_out = 21.4;
  const auto beyond = choose_within(table_with_budgets(), limits, 1, 1, made_with_budgets);
  REQUIRE(beyond);
  REQUIRE(beyond->kept);
  CHECK(beyond->tried[*beyond->kept].point.budget > 131072);
}

TEST_CASE("where nothing is as small as its budget the nearest is the smallest there is") {
  MakeLimits limits;
  limits.bytes = 9000;
  const auto chosen = choose_within(table_with_budgets(), limits, 1, 1, made_with_budgets);
  REQUIRE(chosen);
  CHECK_FALSE(chosen->kept);
  REQUIRE_FALSE(chosen->tried.empty());
  CHECK(chosen->tried.front().too_large());
  CHECK(chosen->nearest_made);
  CHECK_FALSE(chosen->tried.back().too_large());
  CHECK(chosen->nearest.budget == 12160);
  CHECK(chosen->nearest_figures.bytes == 12150);
}

TEST_CASE("a limit of cost that can be met is met by the nearest setting, however much quality is missing") {
  MakeLimits limits;
  limits.held_out = 100;
  limits.bytes = 20000;
  const auto small = choose_within(table_with_budgets(), limits, 1, 1, made_with_budgets);
  REQUIRE(small);
  CHECK_FALSE(small->kept);
  CHECK(small->nearest_made);
  CHECK(small->nearest.budget == 20000);
  CHECK(small->nearest_figures.bytes == 19990);
  // Slabs take 8 s; lobes take 2, and are the worse ones.
  limits.bytes.reset();
  limits.seconds = 5;
  const auto quick = choose_within(table_with_budgets(), limits, 1, 1, made_with_budgets);
  REQUIRE(quick);
  CHECK_FALSE(quick->kept);
  CHECK(quick->nearest_made);
  CHECK(quick->nearest.layers == LayerChoice::paper);
  // In no time: what takes the fewest octaves too long, whatever it lacks.
  limits.seconds = 0.5;
  const auto none = choose_within(table_with_budgets(), limits, 1, 1, made_with_budgets);
  REQUIRE(none);
  CHECK(none->nearest.layers == LayerChoice::paper);
  CHECK(shortfall_of(limits, none->nearest_figures).octaves == doctest::Approx(2));
  CHECK(shortfall_of(limits, none->nearest_figures).decibels == doctest::Approx(84));
}

TEST_CASE("a nearest setting that would take long is told by what is expected of it") {
  MakeLimits limits;
  limits.bytes = 1000;
  std::vector<ExpectedPoint> table = table_with_budgets();
  for (ExpectedPoint& row : table) row.seconds *= 100;
  const auto chosen = choose_within(table, limits, 1, 1, made_with_budgets);
  REQUIRE(chosen);
  CHECK_FALSE(chosen->kept);
  CHECK(chosen->tried.empty());
  CHECK_FALSE(chosen->nearest_made);
  CHECK(chosen->nearest.layers == LayerChoice::slabs);
}

TEST_CASE("a search ends, whatever comes of what was expected") {
  for (const double better_by : {0.0, -0.01, 0.3}) {
    MakeLimits limits;
    limits.held_out = 24;
    limits.bytes = 400000;
    int made = 0;
    // Each comes out just below what is asked for: what is expected is never met.
    const auto chosen = choose_within(expected_points(), limits, 1, 1, [&](const TradePoint& point) {
      ++made;
      return Result<MakeFigures>(MakeFigures{1000, 1e-3 * point.texels, 23.9 + better_by * (made % 2) / 4});
    });
    REQUIRE(chosen);
    CHECK_FALSE(chosen->kept);
    CHECK(made <= static_cast<int>(max_tries));
  }
}

TEST_CASE("a stitch that needs many texels is made with no fewer") {
  MakeLimits limits;
  limits.bytes = 200000;
  const auto chosen = choose_within(expected_points(), limits, 64, 1, [](const TradePoint& point) {
    CHECK(point.texels == 64);
    return Result<MakeFigures>(MakeFigures{1000, 1, std::nan("")});
  });
  REQUIRE(chosen);
  CHECK(chosen->kept);
}
