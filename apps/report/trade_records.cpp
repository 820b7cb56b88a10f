#include "apps/report/trade_records.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <initializer_list>

#include "apps/report/trade_page.h"
#include "format/base/atomic_file.h"
#include "format/base/json_text.h"
#include "format/scene/swatch.h"

namespace selvedge {
namespace {

using Json = nlohmann::ordered_json;

bool is_on(const Json& json, const char* member) {
  return json.contains(member) && json[member].is_boolean() && json[member].get<bool>();
}

/// What would lead out of the folder that the name belongs to, or is no name.
bool is_plain_name(const std::string& name) {
  return !name.empty() && name != "." && name != ".." &&
         name.find_first_of(std::string_view("/\\\0", 3)) == std::string::npos;
}

TradeRow row_of(Json record) {
  TradeRow row;
  row.name = text_at(record, "name");
  row.bytes = number_at(record, "/bytes");
  row.make = number_at(record, "/seconds/make");
  row.work = number_at(record, "/processorSeconds");
  row.load = number_at(record, "/loadMs");
  row.frame = number_at(record, "/frameMs");
  row.picture = number_at(record, "/pictures/all/psnr");
  row.ssim = number_at(record, "/pictures/all/ssim");
  row.held_out = number_at(record, "/heldOut/0/psnr");
  row.record = std::move(record);
  return row;
}

bool has_numbers(const Json& record, std::initializer_list<const char*> pointers) {
  return std::all_of(pointers.begin(), pointers.end(),
                     [&](const char* pointer) { return std::isfinite(number_at(record, pointer)); });
}

/// PSNR and SSIM of the four pictures and of all.
bool has_pictures(const Json& record) {
  const auto has = [&](std::string_view view) {
    const std::string of = fmt::format("/pictures/{}/", view);
    return has_numbers(record, {(of + "psnr").c_str(), (of + "ssim").c_str()});
  };
  return has("all") && std::all_of(swatch_view_names.begin(), swatch_view_names.end(), has);
}

/// Those of the sweep's points that are there, in its order.
Result<std::vector<TradeRow>> read_fabrics(const std::string& folder, const std::vector<std::string>& names) {
  std::vector<TradeRow> rows;
  for (const std::string& name : names) {
    const std::string path = fmt::format("{}/{}/{}.json", folder, trade_points_folder, name);
    std::error_code none;
    if (!std::filesystem::exists(path, none)) continue;
    auto record = read_trade_record(path);
    if (!record) return tl::unexpected(record.error());
    TradeRow row = row_of(std::move(*record));
    if (!is_point_record(row.record, name))
      return fail(Code::file_damaged, path, "", "is not the record of the point");
    rows.push_back(std::move(row));
  }
  return rows;
}

bool holds_all(const Json& json, const Json& members) {
  return std::all_of(members.items().begin(), members.items().end(), [&](const auto& member) {
    return json.contains(member.key()) && json[member.key()] == member.value();
  });
}

/// The viewer's records of this sweep: an earlier one's centre, size or machine may have left others.
std::vector<TradeRow> read_frames(const std::string& folder, const std::vector<std::string>& points,
                                  Json& presets) {
  const std::string path = folder + "/" + trade_frames_file;
  const auto list = read_trade_record(path);
  if (!list) return {};
  const auto names = trade_names(*list, path, "frames");
  if (!names) return {};
  presets = object_at(*list, "presets");
  const Json made_by = object_at(*list, "madeBy");
  std::vector<TradeRow> rows;
  for (const std::string& name : *names) {
    auto record = read_trade_record(fmt::format("{}/{}/{}.json", folder, trade_frames_folder, name));
    if (!record || !is_frame_record(*record, name)) continue;
    const auto point = std::find(points.begin(), points.end(), text_at(*record, "fabric"));
    if (point == points.end() || (is_on(*record, "swept") && point != points.begin())) continue;
    if (holds_all(object_at(*record, "madeBy"), made_by)) rows.push_back(row_of(std::move(*record)));
  }
  return rows;
}

}  // namespace

double number_at(const Json& json, const char* pointer) {
  const Json::json_pointer at(pointer);
  return json.contains(at) && json[at].is_number() ? json[at].get<double>() : NAN;
}

std::string text_at(const Json& json, const char* member) {
  return json.contains(member) && json[member].is_string() ? json[member].get<std::string>() : "";
}

Json object_at(const Json& json, const char* member) {
  return json.contains(member) && json[member].is_object() ? json[member] : Json::object();
}

Result<Json> read_trade_record(const std::string& path) {
  const auto text = read_file(path);
  if (!text) return tl::unexpected(text.error());
  // Depth and repeated members have been looked at when this gives no value that is discarded.
  if (parse_json(*text).is_discarded()) return fail(Code::file_damaged, path, "", "is not JSON");
  Json json = Json::parse(*text);
  if (!json.is_object()) return fail(Code::file_damaged, path, "", "is not a JSON object");
  return json;
}

Result<std::vector<std::string>> trade_names(const Json& record, const std::string& path,
                                             const char* member) {
  if (!record.contains(member) || !record[member].is_array())
    return fail(Code::file_damaged, path, member, "is no list of names");
  std::vector<std::string> names;
  for (const Json& name : record[member]) {
    if (!name.is_string() || !is_plain_name(name.get<std::string>())) {
      return fail(Code::file_damaged, path, fmt::format("{}/{}", member, names.size()),
                  "is not the name of a file in this folder");
    }
    names.push_back(name.get<std::string>());
  }
  return names;
}

bool is_frame_record(const Json& record, const std::string& name) {
  const auto is_flag = [&](const char* member) {
    return record.contains(member) && record[member].is_boolean();
  };
  return record.is_object() && text_at(record, "name") == name && !text_at(record, "fabric").empty() &&
         is_flag("usual") && is_flag("swept") && !text_at(record, "command").empty() &&
         !object_at(record, "knobs").empty() && !object_at(record, "madeBy").empty() &&
         has_numbers(record, {"/loadMs", "/frameMs"}) && has_pictures(record);
}

bool is_point_record(const Json& record, const std::string& name) {
  return record.is_object() && text_at(record, "name") == name && !text_at(record, "command").empty() &&
         !object_at(record, "knobs").empty() && has_pictures(record) &&
         has_numbers(record, {"/bytes", "/seconds/bake", "/seconds/fit", "/seconds/make", "/processorSeconds",
                              "/loadMs", "/heldOut/0/psnr", "/heldOut/0/relativeL2"});
}

Result<Json> read_sweep_record(const std::string& folder) {
  const std::string path = folder + "/" + trade_sweep_file;
  auto sweep = read_trade_record(path);
  if (!sweep) return sweep;
  if (number_at(*sweep, "/trade") != 1) return fail(Code::file_damaged, path, "/trade", "is not 1");
  for (const std::string_view view : swatch_view_names) {
    // A truth without noise has null for its decibels.
    const Json truth = object_at(object_at(*sweep, "truth"), std::string(view).c_str());
    if (!truth.contains("noisePsnr"))
      return fail(Code::file_damaged, path, fmt::format("/truth/{}/noisePsnr", view), "is not there");
  }
  return sweep;
}

Result<TradeTable> read_trade_table(const std::string& folder) {
  TradeTable table;
  const std::string path = folder + "/" + trade_sweep_file;
  auto sweep = read_sweep_record(folder);
  if (!sweep) return tl::unexpected(sweep.error());
  table.sweep = std::move(*sweep);
  const auto names = trade_names(table.sweep, path, "points");
  if (!names) return tl::unexpected(names.error());
  auto fabrics = read_fabrics(folder, *names);
  if (!fabrics) return tl::unexpected(fabrics.error());
  table.fabrics = std::move(*fabrics);
  std::vector<TradeRow> frames = read_frames(folder, *names, table.presets);
  const Json presets = object_at(table.sweep, "presets");
  for (TradeRow& fabric : table.fabrics) {
    // Two presets may be one point.
    std::string quality;
    for (const auto& [preset, name] : presets.items()) {
      if (name == fabric.name) quality += (quality.empty() ? "" : ", ") + preset;
    }
    if (!quality.empty()) fabric.record["quality"] = quality;
    // A fabric's own time per frame is that of the usual settings.
    for (const TradeRow& frame : frames) {
      if (text_at(frame.record, "fabric") != fabric.name || !is_on(frame.record, "usual")) continue;
      fabric.frame = frame.frame;
      fabric.record["frameMs"] = frame.frame;
    }
  }
  for (TradeRow& frame : frames) {
    if (is_on(frame.record, "swept")) table.frames.push_back(std::move(frame));
  }
  return table;
}

}  // namespace selvedge
