// Bytes -> read_chart; what it accepts can be drawn.
#include <algorithm>

#include "converter/stitch/chart.h"
#include "tests/fuzz/target.h"

using namespace selvedge;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Result<ChartText> chart = read_chart({reinterpret_cast<const char*>(data), size}, "input");
  if (!chart) return 0;
  KnitChart& knit = chart->knit;
  fuzz::require(!knit.rows.empty() && !knit.yarns.empty(), "a chart has rows and yarns");
  const std::size_t columns = knit.rows.front().size();
  for (const auto& row : knit.rows) {
    fuzz::require(row.size() == columns, "rows are of one length");
    std::size_t held = 0;
    for (const ChartStitch& stitch : row) held += stitch.source_loops.size();
    fuzz::require(held == columns, "each loop is held by one stitch");
  }
  constexpr std::size_t drawn_stitches = 256;  // more take long
  if (knit.rows.size() * columns > drawn_stitches) return 0;
  // Radii are refused later, by what has room.
  for (Yarn& yarn : knit.yarns) yarn.radius_mm = 0.01 * std::min(knit.wale_mm, knit.course_mm);
  fuzz::require(validate(draw_knit(knit, "chart").pattern, "chart").has_value(),
                "a chart is drawn as a valid pattern");
  return 0;
}
