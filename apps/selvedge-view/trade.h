// The plot and the table of what pictures of a stitch cost and are worth.
#pragma once

#include <string>
#include <vector>

#include "apps/common/report.h"

namespace selvedge {

/// The rows, with `stitch`, `pixels`, `fabric`, `bytes`, `makeSeconds`, `drawn`, `ms` and `db`, for a
/// terminal.
std::string trade_text(const Json& rows);

/// dB against milliseconds, and against bytes, both logarithmic, as an SVG element: a colour for each
/// distance, a mark for each fabric; a line from yarn that moves over its pictures at rest.
std::string trade_plot(const Json& rows);

/// A PNG file and its words.
struct TradePicture {
  std::string caption;
  std::vector<std::uint8_t> png;
};
struct TradeSection {
  std::string stitch;
  Json rows;
  std::vector<TradePicture> pictures;
};
/// A page that needs no file beside it.
std::string trade_page(const std::string& words, const std::vector<TradeSection>& sections);

}  // namespace selvedge
