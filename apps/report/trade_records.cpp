#include "apps/report/trade_records.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "apps/report/trade_page.h"
#include "format/base/atomic_file.h"
#include "format/base/json_text.h"
#include "format/quality/picture_error.h"
#include "format/scene/swatch.h"

namespace selvedge {
namespace {

using Json = nlohmann::ordered_json;

bool is_on(const Json& json, const char* member) {
  return json.contains(member) && json[member].is_boolean() && json[member].get<bool>();
}

/// Whether the name stays within the folder that it belongs to.
bool is_plain_name(const std::string& name) {
  return !name.empty() && name != "." && name != ".." &&
         name.find_first_of(std::string_view("/\\\0", 3)) == std::string::npos;
}

/// PSNR and SSIM of the four pictures and of all.
bool has_pictures(const Json& record) {
  const auto has = [&](std::string_view view) {
    const std::string of = fmt::format("/pictures/{}/", view);
    return has_numbers(record, {(of + "psnr").c_str(), (of + "ssim").c_str()});
  };
  return has("all") && std::all_of(swatch_view_names.begin(), swatch_view_names.end(), has);
}

/// The sweep's points that have been made, in its order.
Result<std::vector<Json>> read_fabrics(const std::string& folder, const std::vector<std::string>& names) {
  std::vector<Json> records;
  for (const std::string& name : names) {
    const std::string path = fmt::format("{}/{}/{}.json", folder, trade_points_folder, name);
    std::error_code none;
    if (!std::filesystem::exists(path, none)) continue;
    auto record = read_trade_record(path);
    if (!record) return tl::unexpected(record.error());
    if (!is_point_record(*record, name))
      return fail(Code::file_damaged, path, "", "is not the record of the point");
    records.push_back(std::move(*record));
  }
  return records;
}

bool holds_all(const Json& json, const Json& members) {
  return std::all_of(members.items().begin(), members.items().end(), [&](const auto& member) {
    return json.contains(member.key()) && json[member.key()] == member.value();
  });
}

/// The viewer's records of this sweep: others may be left from another first point, size or machine.
std::vector<Json> read_frames(const std::string& folder, const std::vector<std::string>& points,
                              Json& presets) {
  const std::string path = folder + "/" + trade_frames_file;
  const auto list = read_trade_record(path);
  if (!list) return {};
  const auto names = trade_names(*list, path, "frames");
  if (!names) return {};
  presets = object_at(*list, "presets");
  const Json made_by = object_at(*list, "madeBy");
  std::vector<Json> records;
  for (const std::string& name : *names) {
    auto record = read_trade_record(fmt::format("{}/{}/{}.json", folder, trade_frames_folder, name));
    if (!record || !is_frame_record(*record, name)) continue;
    const auto point = std::find(points.begin(), points.end(), text_at(*record, "fabric"));
    if (point == points.end() || (is_on(*record, "swept") && point != points.begin())) continue;
    if (holds_all(object_at(*record, "madeBy"), made_by)) records.push_back(std::move(*record));
  }
  return records;
}

}  // namespace

bool has_numbers(const Json& record, std::initializer_list<const char*> pointers) {
  return std::all_of(pointers.begin(), pointers.end(),
                     [&](const char* pointer) { return std::isfinite(number_at(record, pointer)); });
}

Result<Json> picture_errors_json(const std::vector<Frame>& frames, const std::vector<Frame>& truth) {
  Json json = Json::object();
  std::vector<PictureError> errors;
  const auto add = [&](std::string_view name, const PictureError& error) {
    json[std::string(name)] = {{"psnr", psnr_of(error.mean_square)}, {"ssim", error.ssim}};
  };
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const auto error = picture_error(frames[i], truth[i]);
    if (!error) return tl::unexpected(error.error());
    errors.push_back(*error);
    add(swatch_view_names[i], *error);
  }
  add("all", mean_of(errors));
  return json;
}

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
  std::vector<Json> frames = read_frames(folder, *names, table.presets);
  const Json presets = object_at(table.sweep, "presets");
  for (Json& fabric : table.fabrics) {
    const std::string name = text_at(fabric, "name");
    // Two presets may be one point.
    std::string quality;
    for (const auto& [preset, point] : presets.items()) {
      if (point == name) quality += (quality.empty() ? "" : ", ") + preset;
    }
    if (!quality.empty()) fabric["quality"] = quality;
    // A fabric's own time per frame is that of the usual settings.
    for (const Json& frame : frames) {
      if (text_at(frame, "fabric") == name && is_on(frame, "usual")) fabric["frameMs"] = frame["frameMs"];
    }
  }
  for (Json& frame : frames) {
    if (is_on(frame, "swept")) table.frames.push_back(std::move(frame));
  }
  return table;
}

}  // namespace selvedge
