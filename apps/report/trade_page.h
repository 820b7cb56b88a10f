// The result of a sweep over speed and accuracy, out of the records in its folder: trade.json, trade.csv and
// index.html, a page that needs nothing beside it. Both programs add to a folder and call this; docs/trade.md
// has the files.
#pragma once

#include <string>
#include <vector>

#include "format/base/error.h"

namespace selvedge {

// Names in the folder.
inline constexpr const char* trade_sweep_file = "sweep.json";
inline constexpr const char* trade_points_folder = "points";  ///< a record each of fabrics
inline constexpr const char* trade_frames_folder = "frames";  ///< and of settings of the viewer
/// Which of the latter count: `frames`, their names in order, `madeBy`, what their own have to agree with,
/// and `presets`, from a name of `render --quality` to one of them.
inline constexpr const char* trade_frames_file = "frames.json";
inline constexpr const char* trade_pictures_folder = "pictures";
inline constexpr const char* trade_truth_picture = "truth";  ///< among the pictures, without ending

/// A point of a plot: the larger `quality` the better, the smaller `cost`.
struct TradeFigure {
  double cost = 0;
  double quality = 0;
};

/// True for each that no other beats: no other has less cost and at least the quality, or the same cost and
/// more quality. Of equal ones all are on the front; points that are not finite are not.
std::vector<bool> pareto_front(const std::vector<TradeFigure>& figures);

/// Of the viewer's records those that trade_frames_file names, of points that the sweep has; with all
/// settings those of its first point. Damaged records of the sweep and of its points are refused
/// (FILE_DAMAGED), those of the viewer left out.
Result<void> write_trade_page(const std::string& folder);

}  // namespace selvedge
