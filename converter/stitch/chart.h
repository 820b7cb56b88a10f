// Converts knitting charts as text to knits (spec/chart.md):
//
//   name: rope
//   wale_mm: 5
//   course_mm: 3.8
//   yarn A: albedo=#c8b89a radius_mm=0.6 yarn=wool
//   2: p2 c4f p2
//   1: p2 k4 p2
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "converter/stitch/knit.h"
#include "converter/stitch/parameters.h"
#include "format/base/error.h"

namespace selvedge {

/// Largest text that is read, bytes.
constexpr std::size_t max_chart_bytes = 1U << 22U;

/// Limits of a chart: stitches of all rows, and of those that are relaxed as they are (or crossings); yarns,
/// yarns of one row.
constexpr std::size_t max_chart_stitches = 1U << 20U;
constexpr std::size_t max_relaxed_stitches = 1U << 14U;
constexpr std::size_t max_chart_yarns = 8;
constexpr std::size_t max_row_yarns = 4;
/// Stitches that a yarn may pass without a remark: knitters catch longer floats.
constexpr int max_float_stitches_without_remark = 5;

/// A chart as its text has it.
struct ChartText {
  std::string name;  ///< empty: it has none
  KnitChart knit;    ///< its yarns have radius, albedo and kind (fibre)
  /// Further settings of each yarn, by their names without a prefix.
  std::vector<StitchSettings> settings;
  std::vector<std::string> remarks;  ///< one line each
};

/// Radius, mm, of yarn of this kind (fibres.h) in stitches of the chart's size, where none is said: soft yarn
/// is thicker.
double default_radius(const KnitChart& chart, int kind);

/// Reads charts and written instructions. Refuses (stitch_invalid, place: the line) unknown keys and
/// stitches, numbers and counts out of range, gaps in the numbers of rows, rows that do not fit one width,
/// decreases without yarn overs, and cables for whose crossing there are too few rows.
Result<ChartText> read_chart(std::string_view text, const std::string& file);

/// The cells (text_cells.h) of a chart as far as its lines can be read, or of instructions that can be.
Result<nlohmann::ordered_json> read_chart_cells(std::string_view text, const std::string& file);

}  // namespace selvedge
