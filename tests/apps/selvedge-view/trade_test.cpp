#include "apps/selvedge-view/trade.h"

#include <doctest/doctest.h>
#include <fmt/format.h>

namespace selvedge {
namespace {

Json row(int pixels, const char* fabric, const char* drawn, double ms, double db) {
  return {{"stitch", "knit"}, {"pixels", pixels}, {"fabric", fabric}, {"bytes", 1000},
          {"makeSeconds", 1}, {"drawn", drawn},   {"ms", ms},         {"db", db}};
}

TEST_CASE("the plot has a mark for every row, and a line of yarn for each distance") {
  const Json rows{row(120, "yarn", "2 x 2 rays", 1000, 30), row(120, "yarn", "moving", 10, 20),
                  row(120, "paper", "moving", 1, 15), row(8, "yarn", "moving", 10, 25),
                  row(8, "yarn", "--seconds 1", 100, 30)};
  const std::string svg = trade_plot(rows);
  // Milliseconds: 0.9 and 3.1 decades over 540 px, from 50; dB: 15 to 30 over 310 px, from 330.
  const double decade = 540 / 3.2;
  for (const auto& [ms, db] : {std::pair(0.0, 15.0), std::pair(1.0, 20.0), std::pair(3.0, 30.0)}) {
    const double x = 50 + (ms + 0.1) * decade;
    const double y = 330 - (db - 15) * 310 / 15;
    CHECK(svg.find(fmt::format("{:.1f},{:.1f}", x, y)) != std::string::npos);
  }
  CHECK(svg.find(fmt::format("d=\"M{:.1f},{:.1f}L", 50 + 1.1 * decade, 330 - 5 * 310 / 15.0)) !=
        std::string::npos);
}

TEST_CASE("the page of a trade has every row and picture") {
  const std::string page =
      trade_page("words", {{"knit & purl", Json{row(8, "<a>", "moving", 12, 20)}, {{"moving", {1, 2, 3}}}},
                           {"twill", Json{row(8, "b", "moving", 12, 20)}, {}}});
  for (const char* part :
       {"<h1>knit &amp; purl: the trade</h1>", "<h1>twill: the trade</h1>",
        "<td>&lt;a&gt;</td><td>1000</td><td>1.0</td><td>moving</td><td>12</td><td>20.0</td>", "<svg",
        "base64,AQID\"><figcaption>moving<"})
    CHECK(page.find(part) != std::string::npos);
}

}  // namespace
}  // namespace selvedge
