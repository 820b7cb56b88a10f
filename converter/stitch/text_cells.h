// Texts of stitches, and their cells for those who edit them. A picture is a knitting chart, as for knitting
// machines: a pixel is a knit stitch, a colour a yarn.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace selvedge {

enum class StitchText { draft, chart, description };

/// Drafts are known by their beginning, too, under any name.
StitchText kind_of_text(const std::string& text, const std::string& path);

/// The text of a stitch in a file; of a picture, its chart. Ends reading (guard.h) at files that are not
/// there (STITCH_UNKNOWN) or no texts.
std::string stitch_text_in(const std::string& path);

/// The cells of the chart, instructions, picture or draft in a file, as far as they can be read; null of a
/// description or where nothing can be read.
///
/// A chart: its own `name`; `yarns`, each with name and linear albedo; `rows` from the top, each with number,
/// line, stitches (name, columns), and the names of its yarns; a row that cannot be read has no stitches.
/// `chart`: the same as the text of a chart, of a picture or of instructions; empty where a stitch has no
/// name. A draft: `ends`, `picks`, `shafts`, `treadles`; up to max_cell_side of them the numbers of
/// `threading`, `tieup`, and `treadling` or, without treadles, `liftplan`, and `drawdown`, # where the warp
/// is over; `lines` of sections and entries, by the names that messages give them.
nlohmann::ordered_json chart_or_draft_json(const std::string& path);

/// Largest picture, pixels each way, and its colours.
constexpr int max_picture_side = 1024;
constexpr int max_picture_colours = 6;
/// Stitches that a yarn of a picture may pass before it is caught.
constexpr int usual_float_stitches = 7;

/// The chart (chart.h) of a PNG: its bottom row is row 1, its most frequent colour the first yarn. Ends
/// reading (STITCH_INVALID) at pictures that are larger, have more colours, or pixels that are not opaque.
std::string chart_of_picture(const std::string& bytes, const std::string& file);

}  // namespace selvedge
