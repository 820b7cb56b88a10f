// A plot of cost against quality with the front of those that no other beats.
#pragma once

#include <string>
#include <vector>

#include "apps/report/drawing.h"
#include "apps/report/trade_page.h"

namespace selvedge {

struct TradePlot {
  std::string title;
  std::string cost;                  ///< what the axis below says, with its unit; logarithmic
  std::string quality;               ///< the axis at the left; linear
  std::vector<TradeFigure> figures;  ///< labelled 1, 2, 3 ...
};

/// Points whose cost is not positive or that are not finite are left out; without any other there are no
/// shapes. The front is a line of steps: the best quality up to that cost.
Drawing trade_plot(const TradePlot& plot);

}  // namespace selvedge
