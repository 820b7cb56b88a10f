#include "converter/quality.h"

#include <doctest/doctest.h>

#include <algorithm>

#include "converter/make_within.h"

using namespace selvedge;

namespace {

/// The row of the table; its end where there is none.
const ExpectedPoint* row_of(const TradePoint& point) {
  for (const ExpectedPoint& row : expected_points()) {
    if (row.point == point) return &row;
  }
  return nullptr;
}

// Runs of the same setting differ by so much: times by what else a machine does, pictures by what another
// seed makes of them.
constexpr double noise_of_seconds = 0.1;
constexpr double noise_of_pictures = 0.05;

/// Whether `a` beats `b`: no worse in anything beyond the noise, and better in something beyond it.
bool beats(const ExpectedPoint& a, const ExpectedPoint& b) {
  const bool no_worse = a.bytes <= b.bytes && a.seconds <= b.seconds * (1 + noise_of_seconds) &&
                        a.pictures >= b.pictures - noise_of_pictures;
  const bool better = a.bytes < 0.99 * b.bytes || a.seconds < b.seconds * (1 - noise_of_seconds) ||
                      a.pictures > b.pictures + noise_of_pictures;
  return no_worse && better;
}

/// A table of three settings: cheap, middling, dear.
std::vector<ExpectedPoint> small_table() {
  std::vector<ExpectedPoint> table(3);
  for (int i = 0; i < 3; ++i) table[static_cast<std::size_t>(i)].point.texels = 8 << i;
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
  const auto chosen = choose_within(small_table(), limits, 1, made_of);
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
  const auto chosen = choose_within(small_table(), limits, 1, made_of);
  REQUIRE(chosen);
  REQUIRE(chosen->kept);
  CHECK(chosen->tried[*chosen->kept].point.texels == 16);
  // The first that is made may be the best there is.
  limits.seconds = 5;
  const auto first = choose_within(small_table(), limits, 1, made_of);
  REQUIRE(first);
  REQUIRE(first->kept);
  CHECK(first->tried.size() == 1);
}

TEST_CASE("limits that are not to be had together end with the nearest setting") {
  MakeLimits limits;
  limits.held_out = 22.5;
  limits.bytes = 16000;
  const auto chosen = choose_within(small_table(), limits, 1, made_of);
  REQUIRE(chosen);
  CHECK_FALSE(chosen->kept);
  // The dearest has 23 dB but is an octave too large; the middling lacks 1.5 dB.
  CHECK(chosen->nearest.texels == 32);
  CHECK(chosen->nearest_figures.bytes == 32000);
  CHECK(distance_from(limits, chosen->nearest_figures) == doctest::Approx(1));
}

TEST_CASE("an error while a setting is made ends the search") {
  MakeLimits limits;
  limits.seconds = 100;
  const auto chosen = choose_within(small_table(), limits, 1, [](const TradePoint&) -> Result<MakeFigures> {
    return tl::unexpected(Error{Code::file_unwritable, "x", "", "full"});
  });
  REQUIRE_FALSE(chosen);
  CHECK(chosen.error().code == Code::file_unwritable);
}
