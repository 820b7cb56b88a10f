#include "apps/report/trade.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "format/base/atomic_file.h"
#include "format/base/json_text.h"
#include "format/quality/picture_error.h"
#include "format/scene/swatch.h"

namespace selvedge {
namespace {

using Json = nlohmann::ordered_json;

bool is_flag(const Json& json, const char* member) {
  return json.contains(member) && json[member].is_boolean();
}

/// Gives each record the fronts that it lies on.
void add_fronts(Json& records, bool points) {
  for (Json& record : records) record.erase("front");
  for (const TradeCost& cost : trade_costs) {
    if (!points && cost.name != std::string_view("frame")) continue;
    const std::vector<bool> front = pareto_front(trade_figures(records, cost.pointer, trade_psnr));
    for (std::size_t i = 0; i < front.size(); ++i) records[i]["front"][cost.name] = bool{front[i]};
  }
}

/// What the page shows of the records beside their own figures.
void complete(Json& trade) {
  Json points = trade["points"];
  const Json presets = object_at(trade, "presets");
  for (Json& point : points) {
    point.erase("quality");
    point.erase("frameMs");
    // Two presets may be one point.
    std::string quality;
    for (const auto& [preset, name] : presets.items()) {
      if (name == point["name"]) quality += (quality.empty() ? "" : ", ") + preset;
    }
    if (!quality.empty()) point["quality"] = quality;
  }
  Json frames = Json::array();
  Json usual = Json::array();
  for (const Json& frame : trade_frames(trade)) {
    const auto point = std::find_if(points.begin(), points.end(),
                                    [&](const Json& p) { return p["name"] == frame["fabric"]; });
    const bool swept = frame["swept"].get<bool>();
    if (point == points.end() || (swept && point != points.begin())) continue;
    // A fabric's own time per frame is that of the usual settings.
    if (frame["usual"].get<bool>()) (*point)["frameMs"] = frame["frameMs"];
    (swept ? frames : usual).push_back(frame);
  }
  add_fronts(frames, false);
  add_fronts(points, true);
  trade["points"] = std::move(points);
  trade["frames"] = std::move(frames);
  trade["usualFrames"] = std::move(usual);
}

/// A field of a CSV file (RFC 4180).
std::string field(const Json& value) {
  if (value.is_null()) return "";
  std::string text = value.is_string() ? value.get<std::string>() : value.dump();
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  for (std::size_t at = 0; (at = text.find('"', at)) != std::string::npos; at += 2) text.insert(at, 1, '"');
  return '"' + text + '"';
}

/// Each record a line, its members flat: "seconds/make". All columns that any record has.
std::string csv_of(const Json& trade) {
  Json columns = Json::object();
  std::vector<Json> rows;
  for (const char* kind : {"points", "frames"}) {
    for (const Json& record : trade[kind]) {
      rows.push_back(record.flatten());
      for (const auto& [name, value] : rows.back().items()) columns[name] = name.substr(1);
    }
  }
  rows.insert(rows.begin(), columns);
  std::string text;
  for (const Json& row : rows) {
    std::string line;
    for (const auto& [name, title] : columns.items()) line += ',' + field(row.value(name, Json()));
    text += line.substr(std::min<std::size_t>(1, line.size())) + '\n';
  }
  return text;
}

Json member_at(const Json& json, const char* member, Json::value_t type) {
  return json.is_object() && json.contains(member) && json[member].type() == type ? json[member] : Json(type);
}

}  // namespace

double number_at(const Json& json, const std::string& pointer) {
  const Json::json_pointer at(pointer);
  return json.contains(at) && json[at].is_number() ? json[at].get<double>() : NAN;
}

std::string text_at(const Json& json, const char* member) {
  return member_at(json, member, Json::value_t::string).get<std::string>();
}

Json object_at(const Json& json, const char* member) {
  return member_at(json, member, Json::value_t::object);
}

Json array_at(const Json& json, const char* member) { return member_at(json, member, Json::value_t::array); }

bool is_whole(const Json& record, TradeKind kind) {
  std::vector<std::string> numbers{"/loadMs", "/pictures/all/psnr", "/pictures/all/ssim"};
  for (const std::string_view view : swatch_view_names) {
    for (const char* figure : {"psnr", "ssim"})
      numbers.push_back(fmt::format("/pictures/{}/{}", view, figure));
  }
  if (kind == TradeKind::point) {
    numbers.insert(numbers.end(), {"/bytes", "/seconds/bake", "/seconds/fit", "/seconds/make",
                                   "/processorSeconds", "/heldOut/0/psnr", "/heldOut/0/relativeL2"});
  } else {
    numbers.emplace_back("/frameMs");
    if (text_at(record, "fabric").empty() || object_at(record, "madeBy").empty() ||
        !is_flag(record, "usual") || !is_flag(record, "swept"))
      return false;
  }
  const std::string name = text_at(record, "name");
  return !name.empty() && name != "." && name != ".." &&
         name.find_first_of(std::string_view("/\\\0", 3)) == std::string::npos &&
         !text_at(record, "command").empty() && !object_at(record, "knobs").empty() &&
         std::all_of(numbers.begin(), numbers.end(),
                     [&](const std::string& pointer) { return std::isfinite(number_at(record, pointer)); });
}

Json trade_frames(const Json& trade) {
  Json frames = Json::array();
  for (const char* kind : {"frames", "usualFrames"}) {
    for (const Json& frame : array_at(trade, kind)) {
      if (is_whole(frame, TradeKind::frame)) frames.push_back(frame);
    }
  }
  return frames;
}

Result<Json> read_trade(const TradeFolder& folder) {
  const auto text = read_file(folder.record());
  if (!text) return tl::unexpected(text.error());
  // This one looks at depth and repeated members, and does not keep the order.
  if (!parse_json(*text).is_object())
    return fail(Code::file_damaged, folder.record(), "", "is not a JSON object");
  return Json::parse(*text);
}

Result<void> check_trade(const TradeFolder& folder, const Json& trade) {
  const auto damaged = [&](const std::string& place, const char* why) {
    return fail(Code::file_damaged, folder.record(), place, why);
  };
  if (number_at(trade, "/trade") != 1) return damaged("/trade", "is not 1");
  for (const std::string_view view : swatch_view_names) {
    // A truth without noise has null for its decibels.
    if (!object_at(object_at(trade, "truth"), std::string(view).c_str()).contains("noisePsnr"))
      return damaged(fmt::format("/truth/{}/noisePsnr", view), "is not there");
  }
  if (!trade.contains("points") || !trade["points"].is_array())
    return damaged("/points", "is no list of points");
  for (std::size_t i = 0; i < trade["points"].size(); ++i) {
    if (!is_whole(trade["points"][i], TradeKind::point))
      return damaged(fmt::format("/points/{}", i), "is not the record of a point");
  }
  return {};
}

Result<void> write_trade(const TradeFolder& folder, const Json& trade) {
  return write_file(folder.record(), trade.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

Result<void> write_trade_page(const TradeFolder& folder, Json trade) {
  if (auto ok = check_trade(folder, trade); !ok) return ok;
  complete(trade);
  if (auto ok = write_trade(folder, trade); !ok) return ok;
  if (auto ok = write_file(folder.path + "/trade.csv", csv_of(trade)); !ok) return ok;
  return write_file(folder.path + "/index.html", trade_page(folder, trade));
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

std::vector<V2d> trade_figures(const Json& records, const char* cost, const char* quality) {
  std::vector<V2d> figures;
  for (const Json& record : records)
    figures.emplace_back(number_at(record, cost), number_at(record, quality));
  return figures;
}

std::vector<bool> pareto_front(const std::vector<V2d>& figures) {
  std::vector<bool> front;
  for (const V2d& a : figures) {
    // Comparisons with what is not finite are false.
    front.push_back(std::isfinite(a.x) && std::isfinite(a.y) &&
                    std::none_of(figures.begin(), figures.end(), [&](const V2d& b) {
                      return b.x <= a.x && b.y >= a.y && (b.x < a.x || b.y > a.y);
                    }));
  }
  return front;
}

}  // namespace selvedge
