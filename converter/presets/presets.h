// Settings of the road from stitch to fabric that were found to be worth their cost, by a sweep over a grid
// of them (docs/trade.md); and what each setting of that grid is expected to cost.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string_view>

#include "converter/presets/settings.h"

namespace selvedge {

enum class Quality { draft, standard, high, reference };

/// As on command lines, in the order of the enumeration.
inline constexpr std::array<std::string_view, 4> quality_names{"draft", "standard", "high", "reference"};
std::optional<Quality> quality_named(std::string_view name);

/// None of them is beaten, in bytes, seconds and pictures together, by any other of the grid:
/// tests/bench/quality (docs/trade.md).
TradePoint point_of(Quality quality);

/// What a setting cost and was worth, the mean over the stitches of quality_table.cpp.
struct ExpectedPoint {
  TradePoint point;
  double bytes = 0;
  double seconds = 0;   ///< of the processor, all cores together, to bake and fit
  double held_out = 0;  ///< dB, held-out pairs at 64 x 64 texels as compare_with_finer() has it
  double pictures = 0;  ///< dB, of four swatches against the traced stitch
};

/// The committed grid, measured. tests/bench/trade writes quality_table.cpp.
std::span<const ExpectedPoint> expected_points();

}  // namespace selvedge
