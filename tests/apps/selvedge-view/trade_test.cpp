#include "apps/selvedge-view/trade.h"

#include <doctest/doctest.h>

namespace selvedge {
namespace {

Json row(int pixels, const char* quality, int bytes, double moving, double rest) {
  return {{"pixels", pixels}, {"quality", quality}, {"bytes", bytes},
          {"movingMs", 1},    {"movingDb", moving}, {"restDb", rest}};
}

TEST_CASE("the front has the rows that none of their distance beats in both bytes and dB") {
  Json rows{row(120, "draft", 20, 30, 35), row(120, "standard", 10, 31, 35), row(120, "paper", 90, 25, 40),
            row(30, "draft", 20, 29, 30),  row(30, "standard", 20, 29, 30),  row(30, "paper", 90, 28, 20)};
  mark_front(rows);
  std::vector<bool> front;
  for (const Json& row : rows) front.push_back(row["front"]);
  CHECK(front == std::vector<bool>{false, true, true, true, true, false});
  CHECK(front_words(rows) ==
        "On the front, where none has fewer bytes and more dB: draft at 30; standard at 120, 30; paper at "
        "120.");
}

TEST_CASE("the page of a trade has every row and picture") {
  Json rows{row(8, "<a>", 1000, 20, 25)};
  mark_front(rows);
  const std::string page = trade_page("knit & purl", "words", rows, {{"moving", {1, 2, 3}}});
  for (const char* part :
       {"<h1>knit &amp; purl</h1>", "<td>&lt;a&gt;</td><td>1000</td><td>-</td><td>1</td><td>20.0</td>",
        "base64,AQID\"><figcaption>moving<"})
    CHECK(page.find(part) != std::string::npos);
}

}  // namespace
}  // namespace selvedge
