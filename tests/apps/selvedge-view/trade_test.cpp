#include "apps/selvedge-view/trade.h"

#include <doctest/doctest.h>

#include <cmath>

#include "tests/require.h"

namespace selvedge {
namespace {

Json row(const char* setting, double bytes, double seconds, double db) {
  return {{"setting", setting}, {"bytes", bytes}, {"seconds", seconds}, {"pictureDb", db}};
}

TEST_CASE("limits choose the best picture, or the fastest of a quality") {
  const Json rows{row("a", 10, 1, 20), row("b", 20, 2, 25), row("c", 30, 3, 24), row("d", 40, 4, 30)};
  const auto chosen = [&](const TradeLimits& limits) {
    const Json* found = chosen_row(rows, limits);
    return found == nullptr ? std::string("none") : (*found)["setting"].get<std::string>();
  };
  CHECK(chosen({}) == "d");
  CHECK(chosen({30, {}, {}}) == "b");
  CHECK(chosen({19, {}, {}}) == "a");
  CHECK(chosen({{}, 24, {}}) == "b");
  CHECK(chosen({{}, 24, 1.5}) == "none");
  CHECK(chosen({{}, {}, 3}) == "b");
}

TEST_CASE("a table is read as it was written") {
  Json rows{row("set=yarn=tube,wool", 1234, 0.5, 25.25), row("say \"x\"\nor y", 1, 2, 3)};
  rows[1]["pictureDb"] = nullptr;
  const std::string csv = csv_of(rows);
  CHECK(csv.starts_with("setting,bytes,seconds,pictureDb\n\"set=yarn=tube,wool\",1234.0,0.5,25.25\n"));
  const auto read = rows_of(csv, "t.csv");
  REQUIRE(read);
  CHECK(*read == rows);
  CHECK(test::error_of(rows_of("a,b\n1,2\n", "t.csv")).place == "bytes");
  CHECK(test::error_of(rows_of("bytes,seconds,pictureDb\n1,2\n", "t.csv")).place == "record 2");
}

TEST_CASE("the front has the points that no other beats") {
  CHECK(pareto_front({{1, 1}, {2, 1}, {2, 3}, {3, 3}, {1, 1}, {NAN, 9}}) ==
        std::vector<bool>{true, false, true, false, true, false});
}

TEST_CASE("a page shows every row, and plots those with both figures") {
  Json rows{row("<a>", 1000, 1, 20), row("b", 2000, 2, 25)};
  rows[0]["frameMs"] = 5;
  const std::string page = trade_page("knit & purl", rows, {"1", "2"}, "");
  CHECK(page.find("knit &amp; purl") != std::string::npos);
  CHECK(page.find("&lt;a&gt;") != std::string::npos);
  CHECK(page.find("<circle", page.find("ms a frame")) != std::string::npos);
  CHECK(page.find("held-out directions, dB") == std::string::npos);
}

}  // namespace
}  // namespace selvedge
