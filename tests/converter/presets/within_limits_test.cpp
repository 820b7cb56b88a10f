#include "converter/presets/within_limits.h"

#include <doctest/doctest.h>

#include <cmath>

#include "tests/require.h"

using namespace selvedge;

namespace {

/// Three settings without a budget: cheap, middling, dear.
constexpr std::array<MeasuredSetting, 3> plain_table{{{R"({"texels": 8})", 1000, 2, 20, 0},
                                                      {R"({"texels": 16})", 4000, 8, 22, 0},
                                                      {R"({"texels": 32})", 16000, 32, 24, 0}}};

/// A stitch and a machine that take twice the bytes and seconds, and lose 1 dB.
Result<MakeFigures> make_plain(const MakeOptions& options) {
  for (const MeasuredSetting& row : plain_table) {
    if (settings_name(with_knobs(row.knobs)) == settings_name(options))
      return MakeFigures{2 * row.bytes, 2 * row.seconds, row.held_out - 1};
  }
  FAIL("a setting that is not in the table");
  return MakeFigures{};
}

/// Products at two budgets, and lobes with a table, which take less time and are worse.
constexpr std::array<MeasuredSetting, 3> budget_table{
    {{"{}", 100000, 2, 17, 0},
     {R"({"layers": "products", "budget": 32768})", 32768, 8, 20, 0},
     {R"({"layers": "products", "budget": 131072})", 131072, 8, 22, 0}}};

/// A stitch that loses 1 dB, whose lobes take three times the bytes.
Result<MakeFigures> make_with_budget(const MakeOptions& options) {
  if (!options.budget) return MakeFigures{300000, 2, 16};
  const auto bytes = static_cast<double>(*options.budget) - 10;
  return MakeFigures{bytes, 8, 20 + std::log2(bytes / 32768) - 1};
}

template <class Table, class Make>
WithinLimits made(const Table& table, const MakeLimits& limits, const Make& make, int min_texels = 1,
                  int threads = 1) {
  const auto result = test::need(make_within(table, limits, {}, min_texels, threads, make));
  REQUIRE(result.nearest < result.tried.size());
  CHECK(result.tried.size() <= 2);
  CHECK(result.met == meets(limits, result.tried[result.nearest].made));
  return result;
}

int texels_of(const WithinLimits& result) { return result.tried[result.nearest].options.bake.width; }

}  // namespace

TEST_CASE("with a limit of quality the cheapest row that is good enough is made") {
  MakeLimits limits;
  limits.held_out = 20.5;
  limits.bytes = 10000;
  const WithinLimits result = made(plain_table, limits, make_plain);
  CHECK(result.met);
  CHECK(result.tried.size() == 1);
  CHECK(texels_of(result) == 16);
  CHECK(result.tried[0].expected.held_out == 22);
  CHECK(result.tried[0].made.bytes == 8000);
}

TEST_CASE("what came out corrects the table once") {
  // 22 dB are expected of the middling row, which comes to 21; the dear one is then expected to come to 23.
  MakeLimits limits;
  limits.held_out = 21.5;
  const WithinLimits better = made(plain_table, limits, make_plain);
  CHECK(better.met);
  CHECK(better.tried.size() == 2);
  CHECK(texels_of(better) == 32);
  CHECK(better.tried[1].expected.held_out == 23);
  CHECK(better.tried[1].expected.bytes == 32000);
  CHECK(better.tried[1].expected.seconds == 64);
  // 16 s are too many: the cheap one is then expected to take 4.
  limits = {};
  limits.seconds = 9;
  const WithinLimits quicker = made(plain_table, limits, make_plain);
  CHECK(quicker.met);
  CHECK(texels_of(quicker) == 8);
  limits = {};
  limits.bytes = 5000;
  CHECK(texels_of(made(plain_table, limits, make_plain)) == 8);
}

TEST_CASE(
    "without a limit of quality the best row within the limits is made, and threads share the seconds") {
  MakeLimits limits;
  limits.bytes = 9000;
  limits.seconds = 20;
  CHECK(texels_of(made(plain_table, limits, make_plain)) == 16);
  limits = {};
  limits.seconds = 8;
  const WithinLimits result = made(
      plain_table, limits,
      [](const MakeOptions& options) {
        auto figures = make_plain(options);
        figures->seconds /= 8;
        return figures;
      },
      1, 4);
  CHECK(texels_of(result) == 32);
  CHECK(result.tried[0].expected.seconds == 8);
}

TEST_CASE("limits that cannot be met together end with the nearer of two settings, limits of cost first") {
  MakeLimits limits;
  limits.held_out = 22.5;
  limits.bytes = 16000;
  const WithinLimits result = made(plain_table, limits, make_plain);
  CHECK_FALSE(result.met);
  CHECK(result.tried.size() == 2);
  CHECK(texels_of(result) == 16);
  CHECK(result.tried[result.nearest].made.bytes == 8000);
  // Products take 8 s; lobes take 2, and are worse.
  limits = {};
  limits.held_out = 100;
  limits.seconds = 5;
  const WithinLimits quick = made(budget_table, limits, make_with_budget);
  CHECK_FALSE(quick.met);
  CHECK_FALSE(quick.tried[quick.nearest].options.budget);
}

TEST_CASE("layers are chosen within a limit of bytes that nobody measured") {
  MakeLimits limits;
  limits.bytes = 70000;
  const WithinLimits between = made(budget_table, limits, make_with_budget);
  CHECK(between.met);
  CHECK(between.tried[0].options.budget == 70000);
  // Smaller than any of the table.
  limits.bytes = 20000;
  CHECK(made(budget_table, limits, make_with_budget).tried[0].options.budget == 20000);
  // Its own budget is enough for the quality ...
  limits.bytes = 100000;
  limits.held_out = 18.5;
  CHECK(made(budget_table, limits, make_with_budget).tried[0].options.budget == 32768);
  // ... or is not, and the limit is larger.
  limits.held_out = 19.5;
  const WithinLimits corrected = made(budget_table, limits, make_with_budget);
  CHECK(corrected.met);
  CHECK(corrected.tried.size() == 2);
  CHECK(corrected.tried[1].options.budget == 100000);
}

TEST_CASE("an error while a setting is made ends the search") {
  MakeLimits limits;
  limits.seconds = 100;
  const auto result =
      make_within(plain_table, limits, {}, 1, 1, [](const MakeOptions&) -> Result<MakeFigures> {
        return tl::unexpected(Error{Code::file_unwritable, "x", "", "full"});
      });
  REQUIRE_FALSE(result);
  CHECK(result.error().code == Code::file_unwritable);
}

TEST_CASE("a stitch that needs many texels is made with no fewer, and other options stay as they are") {
  MakeLimits limits;
  limits.bytes = 200000;
  MakeOptions base;
  base.bake.seed = 9;
  const auto result = make_within(measured_settings(), limits, base, 64, 1, [](const MakeOptions& options) {
    CHECK(options.bake.width == 64);
    CHECK(options.bake.seed == 9);
    return Result<MakeFigures>(MakeFigures{1000, 1, std::nan("")});
  });
  REQUIRE(result);
  CHECK(result->met);
}
