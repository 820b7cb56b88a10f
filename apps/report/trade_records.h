// The records in the folder of a sweep over speed and accuracy (docs/trade.md). They are read without trust:
// any of them may be damaged.
#pragma once

#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "format/base/error.h"
#include "format/picture/frame.h"

namespace selvedge {

/// The JSON object in a file. FILE_DAMAGED where there is something else, or the errors of read_file().
Result<nlohmann::ordered_json> read_trade_record(const std::string& path);

/// The names in an array of such a record, each fit for a file's name in the folder, else FILE_DAMAGED.
/// `path`: of the record.
Result<std::vector<std::string>> trade_names(const nlohmann::ordered_json& record, const std::string& path,
                                             const char* member);

/// Whether it is a whole record of a setting of the viewer, of that name.
bool is_frame_record(const nlohmann::ordered_json& record, const std::string& name);
/// The same of a point of the sweep that was made.
bool is_point_record(const nlohmann::ordered_json& record, const std::string& name);

/// The record of the sweep in the folder. FILE_DAMAGED where it is not whole.
Result<nlohmann::ordered_json> read_sweep_record(const std::string& folder);

/// The number at a JSON pointer, or NaN.
double number_at(const nlohmann::ordered_json& json, const char* pointer);
/// A member that is a text, or an empty one; a member that is an object, or an empty one.
std::string text_at(const nlohmann::ordered_json& json, const char* member);
nlohmann::ordered_json object_at(const nlohmann::ordered_json& json, const char* member);

/// Whether there is a finite number at each of the JSON pointers.
bool has_numbers(const nlohmann::ordered_json& record, std::initializer_list<const char*> pointers);

/// Errors of the pictures of a record: PSNR and SSIM by place, and of all as if they were one. Frames as
/// all_swatch_views has them. IMAGE_MISMATCH for other sizes.
Result<nlohmann::ordered_json> picture_errors_json(const std::vector<Frame>& frames,
                                                   const std::vector<Frame>& truth);

/// The records that belong on the page of a folder.
struct TradeTable {
  nlohmann::ordered_json sweep;
  std::vector<nlohmann::ordered_json> fabrics;  ///< with `quality` and `frameMs` where they are known
  std::vector<nlohmann::ordered_json> frames;   ///< of settings of the viewer
  nlohmann::ordered_json presets = nlohmann::ordered_json::object();  ///< among the latter
};

/// Only what the sweep and the list of frames name is read. A damaged record of the sweep or of one of its
/// points is refused (FILE_DAMAGED); of frames, damaged ones are left out: `selvedge-view trade` makes them
/// again.
Result<TradeTable> read_trade_table(const std::string& folder);

}  // namespace selvedge
