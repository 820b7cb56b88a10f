#include "apps/common/report.h"

#include <doctest/doctest.h>

using namespace selvedge;

TEST_CASE("the text of a report is made of its members") {
  const Json json{{"name", "knit"},  {"bytes", 1234}, {"texels", {8, 16}},
                  {"none", nullptr}, {"yarn", true},  {"heldOut", {{"psnr", 25.126}}}};
  CHECK(fill_pattern("{name} ({bytes} bytes), {texels}", json) == "knit (1234 bytes), 8x16");
  CHECK(fill_pattern("{heldOut/psnr:.2f} {texels/1} {none} {other/x:.1f} {yarn}", json) == "25.13 16 - - on");
  CHECK(fill_pattern("{bytes:.1e}", json) == "1.2e+03");
}

TEST_CASE("columns of a table are as wide as their widest cell") {
  const Json rows{{{"level", 0}, {"db", 9.5}}, {{"level", 10}}};
  CHECK(table_text(rows, {{"level", "{level}"}, {"PSNR", "{db:.2f} dB"}}) ==
        "  level     PSNR\n      0  9.50 dB\n     10     - dB\n");
}
