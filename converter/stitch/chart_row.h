// The text of one row of a knitting chart: "k2 p2 c4f [A4 B4]" to its stitches; chart.h reads the rest.
#pragma once

#include <string>
#include <vector>

#include "converter/stitch/knit.h"

namespace selvedge {

/// What a chart says wrong, and in which line (0: in none): thrown here, caught by read_chart().
struct ChartFault {
  int line = 0;
  std::string message;
};

struct ChartRow {
  std::vector<ChartStitch> stitches;  ///< whose `yarn` is an index into `letters`
  std::string letters;                ///< of the yarns that the row names; empty: it names none
};

/// Throws a ChartFault of this line for stitches that there are not, counts out of range, yarn overs that are
/// not as many as decreases, and yarns for fewer or more stitches than the row has.
ChartRow row_of(const std::string& text, int line);

}  // namespace selvedge
