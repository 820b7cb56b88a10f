// The records in the folder of a sweep over speed and accuracy, read as files of which nothing is known;
// docs/trade.md has them.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "format/base/error.h"

namespace selvedge {

/// The JSON object in a file: FILE_DAMAGED where it is none, else the errors of read_file().
Result<nlohmann::ordered_json> read_trade_record(const std::string& path);

/// The names that an array of such a record has, each fit for a file's name in the folder: FILE_DAMAGED where
/// it is no array of such. `path`: of the record.
Result<std::vector<std::string>> trade_names(const nlohmann::ordered_json& record, const std::string& path,
                                             const char* member);

/// Whether it is a whole record of a setting of the viewer, of that name.
bool is_frame_record(const nlohmann::ordered_json& record, const std::string& name);
/// The same of a point of the sweep that was made.
bool is_point_record(const nlohmann::ordered_json& record, const std::string& name);

/// The record of the sweep in the folder: FILE_DAMAGED where it is none.
Result<nlohmann::ordered_json> read_sweep_record(const std::string& folder);

/// The number at a JSON pointer, or NaN.
double number_at(const nlohmann::ordered_json& json, const char* pointer);
/// A member's text, or nothing; a member, or an empty object where it is none.
std::string text_at(const nlohmann::ordered_json& json, const char* member);
nlohmann::ordered_json object_at(const nlohmann::ordered_json& json, const char* member);

/// A record with what is asked of it; NaN where it has no such number.
struct TradeRow {
  std::string name;
  nlohmann::ordered_json record;
  double bytes = NAN;
  double make = NAN;     ///< s
  double work = NAN;     ///< s, of all cores
  double load = NAN;     ///< ms
  double frame = NAN;    ///< ms
  double picture = NAN;  ///< dB
  double ssim = NAN;
  double held_out = NAN;  ///< dB at the finest level
};

struct TradeTable {
  nlohmann::ordered_json sweep;
  std::vector<TradeRow> fabrics;
  std::vector<TradeRow> frames;                                       ///< of settings of the viewer
  nlohmann::ordered_json presets = nlohmann::ordered_json::object();  ///< among the latter
};

/// What belongs on the page of the folder, times per frame joined to the fabrics. Only what the sweep and
/// the list of frames name is read. Damaged are FILE_DAMAGED: the sweep's record and those of its points.
/// Of frames what is damaged is left out: `selvedge-view trade` makes it anew.
Result<TradeTable> read_trade_table(const std::string& folder);

}  // namespace selvedge
