// The settings of the viewer that a sweep tries (docs/trade.md).
#pragma once

#include <array>
#include <string>
#include <string_view>
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

/// As options call them.
inline constexpr std::array<std::string_view, 4> frame_quality_names{"draft", "standard", "high",
                                                                     "reference"};

/// How a frame is drawn for the name of that index: levels and samples a pixel alone. What it is worth stands
/// in docs/trade.md.
TradeSetting quality_setting(std::size_t quality);

/// Filters, taps, level blending, the finest level alone, several samples a pixel, fast powers, and who
/// evaluates; the usual one first, those that have names among them. No two have one name.
std::vector<TradeSetting> trade_settings();

}  // namespace selvedge
