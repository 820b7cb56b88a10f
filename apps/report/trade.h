// A sweep over speed and accuracy: its record trade.json, which both programs read and add to, and the table
// and the page that are made of it (docs/trade.md).
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "format/base/error.h"
#include "format/picture/frame.h"

namespace selvedge {

/// Where the files of a sweep lie.
struct TradeFolder {
  std::string path;
  std::string record() const { return path + "/trade.json"; }
  std::string fabric(const std::string& name) const { return path + "/fabrics/" + name + ".fabric.exr"; }
  std::string picture(const std::string& name) const { return path + "/pictures/" + name + ".png"; }
  /// "truth/NAME", without an ending.
  std::string truth(std::string_view name) const { return path + "/truth/" + std::string(name); }
};
inline constexpr const char* trade_truth_picture = "truth";  ///< name among the pictures

// trade.json is read without trust: any part of it may be damaged. What is missing is NaN, or empty.
double number_at(const nlohmann::ordered_json& json, const std::string& pointer);
std::string text_at(const nlohmann::ordered_json& json, const char* member);
nlohmann::ordered_json object_at(const nlohmann::ordered_json& json, const char* member);
nlohmann::ordered_json array_at(const nlohmann::ordered_json& json, const char* member);

enum class TradeKind { point, frame };
/// Whether it is the whole record of a point that was made, or of a setting of the viewer, with a name that
/// is fit for a file's in the folder.
bool is_whole(const nlohmann::ordered_json& record, TradeKind kind);

/// All whole records of the viewer: `frames`, which are those of the page's table, and `usualFrames`, which
/// have the times of points beside the first.
nlohmann::ordered_json trade_frames(const nlohmann::ordered_json& trade);

/// The JSON object in trade.json. FILE_DAMAGED where there is something else, or the errors of read_file().
Result<nlohmann::ordered_json> read_trade(const TradeFolder& folder);
/// FILE_DAMAGED where the head or a point is not whole.
Result<void> check_trade(const TradeFolder& folder, const nlohmann::ordered_json& trade);
/// Writes trade.json alone: the state of a sweep that goes on.
Result<void> write_trade(const TradeFolder& folder, const nlohmann::ordered_json& trade);

/// Writes trade.json, trade.csv and index.html, a page that needs nothing beside it. The points are given
/// `quality`, `frameMs` and `front`. Frames are left out that are damaged, of no point, or with `swept` of
/// another point than the first; those without it become `usualFrames`.
Result<void> write_trade_page(const TradeFolder& folder, nlohmann::ordered_json trade);

/// Errors of pictures from all_swatch_views: PSNR and SSIM by place, and of all as if they were one.
/// IMAGE_MISMATCH for other sizes.
Result<nlohmann::ordered_json> picture_errors_json(const std::vector<Frame>& frames,
                                                   const std::vector<Frame>& truth);

/// Cost and quality of each: true for those that no other beats (no other has less cost and at least the
/// quality, or the same cost and more quality). Of equal ones all are on the front; points that are not
/// finite are not.
std::vector<bool> pareto_front(const std::vector<V2d>& figures);

/// The text of the page; `trade` as write_trade_page() has completed it. Errors: IMAGE_UNWRITABLE.
std::string trade_page(const TradeFolder& folder, const nlohmann::ordered_json& trade);

/// Costs that pictures are weighed against: the name in a record's `front`, where the cost stands, and its
/// words.
struct TradeCost {
  const char* name;
  const char* pointer;
  const char* words;
};
inline constexpr TradeCost trade_costs[] = {{"bytes", "/bytes", "bytes"},
                                            {"make", "/seconds/make", "time to make"},
                                            {"work", "/processorSeconds", "work of all cores"},
                                            {"frame", "/frameMs", "frame"}};
inline constexpr const char* trade_psnr = "/pictures/all/psnr";

/// Cost and quality of records.
std::vector<V2d> trade_figures(const nlohmann::ordered_json& records, const char* cost, const char* quality);

}  // namespace selvedge
