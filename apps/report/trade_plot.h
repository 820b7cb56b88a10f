// A plot of cost against quality with the front of those that no other beats.
#pragma once

#include <string>
#include <vector>

#include "apps/report/drawing.h"
#include "apps/report/trade_page.h"

namespace selvedge {

struct TradePlot {
  std::string title;
  std::string cost;     ///< what the axis below says, with its unit; logarithmic
  std::string quality;  ///< the axis at the left; linear
  std::vector<TradeFigure> figures;
  std::vector<std::string> labels;  ///< of the points, short; as many
};

/// Points whose cost is not positive or that are not finite are left out. The front is a line of steps: what
/// can be had up to that cost.
Drawing trade_plot(const TradePlot& plot);

}  // namespace selvedge
