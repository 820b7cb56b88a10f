// The settings of the viewer that a sweep tries (spec/trade.md).
#pragma once

#include <string>
#include <vector>

#include "viewer/render.h"

namespace selvedge {

struct TradeSetting {
  std::string name;      ///< fit for a file's name
  std::string options;   ///< of selvedge-view render
  std::string knobs;     ///< JSON object
  RenderOptions render;  ///< without size and lights
};

/// What frames are drawn with unless something else is asked for.
TradeSetting usual_setting();

/// Filters, taps, level blending, the finest level alone, several samples a pixel, and who evaluates; the
/// usual one first.
std::vector<TradeSetting> trade_settings();

}  // namespace selvedge
