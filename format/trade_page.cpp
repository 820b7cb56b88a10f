#include "format/trade_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "format/atomic_file.h"
#include "format/json_text.h"
#include "format/markup.h"
#include "format/trade_plot.h"

namespace selvedge {
namespace {

using Json = nlohmann::ordered_json;

/// A record with what is asked of it.
struct Row {
  std::string name;
  Json record;
  double bytes = NAN;
  double make = NAN;     // s
  double work = NAN;     // s, of all cores
  double load = NAN;     // ms
  double frame = NAN;    // ms
  double picture = NAN;  // dB
  double ssim = NAN;
  double held_out = NAN;  // dB at the finest level
};

struct Table {
  Json sweep;
  std::vector<Row> fabrics;
  std::vector<Row> frames;  // of settings of the viewer
  Json presets = Json::object();
};

double number_at(const Json& json, const char* pointer) {
  const Json::json_pointer at(pointer);
  return json.contains(at) && json[at].is_number() ? json[at].get<double>() : NAN;
}

std::string text_at(const Json& json, const char* member) {
  return json.contains(member) && json[member].is_string() ? json[member].get<std::string>() : "";
}

Result<Json> read_record(const std::string& path) {
  const auto text = read_file(path);
  if (!text) return tl::unexpected(text.error());
  // Depth and repeated members have been looked at when this gives no value that is discarded.
  if (parse_json(*text).is_discarded()) return fail(Code::file_damaged, path, "", "is not JSON");
  Json json = Json::parse(*text);
  if (!json.is_object()) return fail(Code::file_damaged, path, "", "is not a JSON object");
  return json;
}

Row row_of(Json record) {
  Row row;
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

std::vector<std::string> names_in(const Json& json, const char* member) {
  std::vector<std::string> names;
  for (const Json& name : json.value(member, Json::array())) {
    if (name.is_string()) names.push_back(name.get<std::string>());
  }
  return names;
}

/// Those of a folder that are `wanted`, in that order, as far as they are there.
Result<std::vector<Row>> read_rows(const std::string& folder, const std::vector<std::string>& wanted) {
  std::map<std::string, Row> rows;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(folder, none)) {
    if (entry.path().extension() != ".json") continue;
    auto record = read_record(entry.path().string());
    if (!record) return tl::unexpected(record.error());
    Row row = row_of(std::move(*record));
    const std::string name = row.name;
    if (name.empty() || !std::isfinite(row.picture))
      return fail(Code::file_damaged, entry.path().string(), "", "is not the record of a point");
    rows.emplace(name, std::move(row));
  }
  std::vector<Row> result;
  for (const std::string& name : wanted) {
    const auto row = rows.find(name);
    if (row != rows.end()) result.push_back(row->second);
  }
  return result;
}

bool holds_all(const Json& json, const Json& members) {
  if (!json.is_object() || !members.is_object()) return false;
  return std::all_of(members.items().begin(), members.items().end(), [&](const auto& member) {
    return json.contains(member.key()) && json[member.key()] == member.value();
  });
}

/// The viewer's records of this sweep: an earlier one's centre, size or machine may have left others.
Result<std::vector<Row>> read_frames(const std::string& folder, const std::vector<std::string>& points,
                                     Json& presets) {
  const std::string path = folder + "/" + trade_frames_file;
  if (!std::filesystem::exists(path)) return std::vector<Row>();
  const auto list = read_record(path);
  if (!list) return tl::unexpected(list.error());
  presets = list->value("presets", Json::object());
  auto rows = read_rows(fmt::format("{}/{}", folder, trade_frames_folder), names_in(*list, "frames"));
  if (!rows) return rows;
  const Json made_by = list->value("madeBy", Json::object());
  const auto other = [&](const Row& row) {
    const std::string fabric = text_at(row.record, "fabric");
    const auto point = std::find(points.begin(), points.end(), fabric);
    return point == points.end() || (row.record.value("swept", false) && point != points.begin()) ||
           !holds_all(row.record.value("madeBy", Json()), made_by);
  };
  rows->erase(std::remove_if(rows->begin(), rows->end(), other), rows->end());
  return rows;
}

Result<Table> read_table(const std::string& folder) {
  Table table;
  auto sweep = read_record(folder + "/" + trade_sweep_file);
  if (!sweep) return tl::unexpected(sweep.error());
  table.sweep = std::move(*sweep);
  const std::vector<std::string> names = names_in(table.sweep, "points");
  auto fabrics = read_rows(fmt::format("{}/{}", folder, trade_points_folder), names);
  if (!fabrics) return tl::unexpected(fabrics.error());
  table.fabrics = std::move(*fabrics);
  auto frames = read_frames(folder, names, table.presets);
  if (!frames) return tl::unexpected(frames.error());
  const Json presets = table.sweep.value("presets", Json::object());
  for (const auto& [preset, name] : presets.items()) {
    for (Row& fabric : table.fabrics) {
      if (name == fabric.name) fabric.record["quality"] = preset;
    }
  }
  // A fabric's own time per frame is that of the usual settings.
  for (Row& fabric : table.fabrics) {
    for (const Row& frame : *frames) {
      if (text_at(frame.record, "fabric") != fabric.name || !frame.record.value("usual", false)) continue;
      fabric.frame = frame.frame;
      fabric.record["frameMs"] = frame.frame;
    }
  }
  for (Row& frame : *frames) {
    if (frame.record.value("swept", false)) table.frames.push_back(std::move(frame));
  }
  return table;
}

/// Where something is on the front of a plot.
struct Fronts {
  std::vector<bool> bytes, make, work, frame;
};

std::vector<TradeFigure> figures(const std::vector<Row>& rows, double Row::*cost, double Row::*quality) {
  std::vector<TradeFigure> result;
  for (const Row& row : rows) result.push_back({row.*cost, row.*quality});
  return result;
}

Fronts fronts_of(const std::vector<Row>& rows) {
  return {pareto_front(figures(rows, &Row::bytes, &Row::picture)),
          pareto_front(figures(rows, &Row::make, &Row::picture)),
          pareto_front(figures(rows, &Row::work, &Row::picture)),
          pareto_front(figures(rows, &Row::frame, &Row::picture))};
}

Json json_of(const Table& table) {
  Json all = {{"program", "selvedge"}, {"report", 1}, {"verb", "trade"}};
  all.update(table.sweep);
  Json points = Json::array();
  const Fronts fronts = fronts_of(table.fabrics);
  for (std::size_t i = 0; i < table.fabrics.size(); ++i) {
    Json point = table.fabrics[i].record;
    point["front"] = {{"bytes", bool{fronts.bytes[i]}},
                      {"make", bool{fronts.make[i]}},
                      {"work", bool{fronts.work[i]}},
                      {"frame", bool{fronts.frame[i]}}};
    points.push_back(std::move(point));
  }
  all["points"] = std::move(points);
  Json frames = Json::array();
  const Fronts of_frames = fronts_of(table.frames);
  for (std::size_t i = 0; i < table.frames.size(); ++i) {
    Json frame = table.frames[i].record;
    frame["front"] = {{"frame", bool{of_frames.frame[i]}}};
    frames.push_back(std::move(frame));
  }
  all["frames"] = std::move(frames);
  if (!table.presets.empty()) all["framePresets"] = table.presets;
  return all;
}

/// A field of a CSV file (RFC 4180).
std::string field(const Json& value) {
  if (value.is_null()) return "";
  std::string text = value.is_string() ? value.get<std::string>() : value.dump();
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += c;
    quoted += c;
  }
  quoted += '"';
  return quoted;
}

/// Each record a line, its members flat: "seconds/make". All columns that any record has.
std::string csv_of(const Json& all) {
  std::vector<std::string> columns;
  std::vector<Json> rows;
  for (const char* kind : {"points", "frames"}) {
    for (const Json& record : all[kind]) {
      Json flat = record.flatten();
      for (const auto& [name, value] : flat.items()) {
        if (std::find(columns.begin(), columns.end(), name) == columns.end()) columns.push_back(name);
      }
      rows.push_back(std::move(flat));
    }
  }
  std::string text;
  const auto add = [&](std::size_t column, const std::string& value) {
    if (column > 0) text += ',';
    text += value;
  };
  for (std::size_t i = 0; i < columns.size(); ++i) add(i, field(columns[i].substr(1)));
  text += '\n';
  for (const Json& row : rows) {
    for (std::size_t i = 0; i < columns.size(); ++i)
      add(i, row.contains(columns[i]) ? field(row[columns[i]]) : std::string());
    text += '\n';
  }
  return text;
}

/// An embedded picture, or nothing where there is none.
std::string picture(const std::string& folder, const std::string& name) {
  const auto bytes = read_file(fmt::format("{}/{}/{}.png", folder, trade_pictures_folder, name));
  if (!bytes) return "";
  const std::span<const char> chars(*bytes);
  const std::vector<std::uint8_t> data(chars.begin(), chars.end());
  return fmt::format(R"(<img alt="{}" src="data:image/png;base64,{}">)", escaped(name), base64(data));
}

Result<std::string> plot(const char* title, const char* cost_text, const char* quality_text,
                         const std::vector<Row>& rows, double Row::*cost, double Row::*quality) {
  TradePlot plot{title, cost_text, quality_text, figures(rows, cost, quality), {}};
  const bool any = std::any_of(plot.figures.begin(), plot.figures.end(), [](const TradeFigure& f) {
    return std::isfinite(f.cost) && f.cost > 0 && std::isfinite(f.quality);
  });
  if (!any) return std::string();
  for (std::size_t i = 0; i < rows.size(); ++i) plot.labels.push_back(fmt::format("{}", i + 1));
  return svg_of(trade_plot(plot));
}

std::string cell(double value, const char* form) {
  return fmt::format("<td>{}</td>", std::isfinite(value) ? fmt::format(fmt::runtime(form), value) : "–");
}

std::string knobs_text(const Json& knobs) {
  std::string text;
  for (const auto& [name, value] : knobs.items())
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name,
                        value.is_string() ? value.get<std::string>() : value.dump());
  return text;
}

std::string views_cells(const Json& record) {
  std::string text;
  for (const char* view : {"near", "middle", "far", "grazing"})
    text += cell(number_at(record, fmt::format("/pictures/{}/psnr", view).c_str()), "{:.2f}");
  return text;
}

/// Of all levels, a line for decibels and one for relative errors.
std::string held_out_text(const Json& record) {
  std::string psnr;
  std::string relative;
  for (const Json& level : record.value("heldOut", Json::array())) {
    psnr += fmt::format("{}{:.1f}", psnr.empty() ? "" : " / ", number_at(level, "/psnr"));
    relative += fmt::format("{}{:.3f}", relative.empty() ? "" : " / ", number_at(level, "/relativeL2"));
  }
  return psnr + "<br>" + relative;
}

/// The true picture again and again, embedded once.
struct TruthPicture {
  std::string definition;
  std::string use;
};

TruthPicture truth_picture(const std::string& folder, const Json& sweep) {
  const auto bytes =
      read_file(fmt::format("{}/{}/{}.png", folder, trade_pictures_folder, trade_truth_picture));
  const double width = 4 * std::floor(number_at(sweep, "/identity/size/0") / 2);
  const double height = std::floor(number_at(sweep, "/identity/size/1") / 2);
  if (!bytes || !(width > 0 && height > 0)) return {};
  const std::span<const char> chars(*bytes);
  const std::vector<std::uint8_t> data(chars.begin(), chars.end());
  return {
      fmt::format(
          R"(<svg width="0" height="0" style="position:absolute"><defs><image id="truth" width="{}" height="{}" href="data:image/png;base64,{}"/></defs></svg>)",
          width, height, base64(data)),
      fmt::format(R"(<svg width="{}" height="{}"><use href="#truth"/></svg>)", width, height)};
}

std::string rows_of(const std::string& folder, const std::vector<Row>& rows, const std::string& truth,
                    bool fabrics) {
  const Fronts fronts = fronts_of(rows);
  std::string text;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Row& row = rows[i];
    std::string front;
    const auto add = [&](bool on, const char* what) {
      if (on) front += fmt::format("{}{}", front.empty() ? "" : ", ", what);
    };
    add(fronts.bytes[i], "bytes");
    add(fronts.make[i], "time to make");
    add(fronts.frame[i], "frame");
    const Json knobs = row.record.value("knobs", Json::object());
    const std::string quality = text_at(row.record, "quality");
    text += fmt::format("<tr{}><td>{}</td><td class=\"l\">{}{}<br><code>{}</code></td>",
                        front.empty() ? "" : " class=\"front\"", i + 1,
                        quality.empty() ? "" : fmt::format("<b>{}</b>: ", escaped(quality)),
                        escaped(knobs_text(knobs)), escaped(text_at(row.record, "command")));
    text += views_cells(row.record) + cell(row.picture, "{:.2f}") + cell(row.ssim, "{:.4f}");
    if (fabrics) {
      text += fmt::format("<td class=\"l\">{}</td>", held_out_text(row.record));
      text += cell(row.bytes, "{:.0f}") + cell(number_at(row.record, "/seconds/bake"), "{:.2f}") +
              cell(number_at(row.record, "/seconds/fit"), "{:.2f}") +
              cell(number_at(row.record, "/processorSeconds"), "{:.2f}");
    }
    text += cell(row.load, "{:.2f}") + cell(row.frame, "{:.2f}");
    text += fmt::format("<td class=\"l\">{}</td><td>{}<br>{}</td></tr>\n", front, picture(folder, row.name),
                        truth);
  }
  return text;
}

constexpr const char* style = R"(<style>
body { font: 14px/1.45 "DejaVu Sans", Verdana, sans-serif; color: #1b1f24; margin: 24px; }
table { border-collapse: collapse; font-size: 12px; }
td, th { border-bottom: 1px solid #d0d5dc; padding: 4px 8px; text-align: right; vertical-align: top; }
.l { text-align: left; }
tr.front { background: #fdf1e7; }
code { font-size: 11px; color: #626b76; overflow-wrap: anywhere; }
.plots { display: flex; flex-wrap: wrap; gap: 16px; }
td.l { max-width: 420px; }
p { max-width: 900px; }
</style>
)";

std::string text_of_sweep(const Table& table) {
  const Json identity = table.sweep.value("identity", Json::object());
  const Json machine = identity.value("machine", Json::object());
  std::string noise;
  const Json truth = table.sweep.value("truth", Json::object());
  for (const auto& [view, value] : truth.items())
    noise += fmt::format("{}{} {:.1f} dB", noise.empty() ? "" : ", ", view, number_at(value, "/noisePsnr"));
  return fmt::format(
      "<p>{} by {}. Measured on {}, {} cores, {} threads; times are medians of {} runs, all points of one "
      "sweep. Pictures of {} x {} pixels against the traced stitch, {} rays a pixel, in sRGB after exposure; "
      "what the truth's own noise would make: {}. Held-out errors against {} pairs of directions at {} "
      "texels, {} rays each, from the finest level to the mean of the cell.</p>\n",
      escaped(text_at(identity, "stitch")), escaped(text_at(identity, "software")),
      escaped(text_at(machine, "processor")), number_at(machine, "/cores"), number_at(machine, "/threads"),
      number_at(identity, "/repeats"), number_at(identity, "/size/0"), number_at(identity, "/size/1"),
      number_at(identity, "/truthSamples"), escaped(noise), number_at(identity, "/heldOut/pairs"),
      number_at(identity, "/heldOut/texels"), number_at(identity, "/heldOut/samples"));
}

Result<std::string> html_of(const std::string& folder, const Table& table) {
  const std::string title = fmt::format("Speed against accuracy: {}",
                                        text_at(table.sweep.value("identity", Json::object()), "stitch"));
  std::string text = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta "
      "charset=\"utf-8\"><title>{0}</title>\n{1}</head><body>\n"
      "<h1>{0}</h1>\n",
      escaped(title), style);
  text += text_of_sweep(table) + "<div class=\"plots\">\n";
  const auto add = [&](Result<std::string> plot) -> Result<void> {
    if (!plot) return tl::unexpected(plot.error());
    text += *plot;
    return {};
  };
  constexpr const char* picture_error = "pictures, PSNR in dB";
  constexpr const char* held_out_error = "held out, finest level, dB";
  for (auto& plot : {plot("Pictures against bytes", "bytes of the file", picture_error, table.fabrics,
                          &Row::bytes, &Row::picture),
                     plot("Pictures against time to make", "seconds to bake and fit", picture_error,
                          table.fabrics, &Row::make, &Row::picture),
                     plot("Pictures against time per frame", "ms a frame", picture_error, table.fabrics,
                          &Row::frame, &Row::picture),
                     plot("Held-out directions against bytes", "bytes of the file", held_out_error,
                          table.fabrics, &Row::bytes, &Row::held_out),
                     plot("Held-out directions against time to make", "seconds to bake and fit",
                          held_out_error, table.fabrics, &Row::make, &Row::held_out),
                     plot("The viewer's settings", "ms a frame", picture_error, table.frames, &Row::frame,
                          &Row::picture)}) {
    if (auto ok = add(plot); !ok) return tl::unexpected(ok.error());
  }
  text +=
      "</div>\n<p>The line is the front: what can be had up to that cost. Numbers are those of the tables, "
      "where settings on a front are coloured.</p>\n";
  const TruthPicture truth = truth_picture(folder, table.sweep);
  text += truth.definition + "\n";
  constexpr const char* picture_columns =
      "<th>near</th><th>middle</th><th>far</th><th>grazing</th><th>all, dB</th><th>SSIM</th>";
  text += fmt::format(
      "<h2>Fabrics</h2>\n<table><tr><th>#</th><th class=\"l\">knobs, command</th>{}<th class=\"l\">held out, "
      "dB and relative L2 by "
      "level</th><th>bytes</th><th>bake, s</th><th>fit, s</th><th>all cores, s</th><th>load, "
      "ms</th><th>frame, ms</th>"
      "<th class=\"l\">on the front of</th><th class=\"l\">near, middle, far, grazing; the truth "
      "below</th></tr>\n{}</table>\n",
      picture_columns, rows_of(folder, table.fabrics, truth.use, true));
  if (!table.frames.empty()) {
    text += fmt::format(
        "<h2>Settings of the viewer</h2>\n<table><tr><th>#</th><th class=\"l\">knobs, command</th>{}"
        "<th>load, ms</th><th>frame, ms</th><th class=\"l\">on the front of</th><th class=\"l\">the "
        "same</th></tr>\n{}</table>\n",
        picture_columns, rows_of(folder, table.frames, truth.use, false));
  }
  return text + "</body></html>\n";
}

}  // namespace

std::vector<bool> pareto_front(const std::vector<TradeFigure>& figures) {
  std::vector<bool> front;
  for (const TradeFigure& a : figures) {
    bool stands = std::isfinite(a.cost) && std::isfinite(a.quality);
    for (const TradeFigure& b : figures) {
      if (!std::isfinite(b.cost) || !std::isfinite(b.quality)) continue;
      const bool beats =
          b.cost <= a.cost && b.quality >= a.quality && (b.cost < a.cost || b.quality > a.quality);
      stands = stands && !beats;
    }
    front.push_back(stands);
  }
  return front;
}

Result<void> write_trade_page(const std::string& folder) {
  const auto table = read_table(folder);
  if (!table) return tl::unexpected(table.error());
  const Json json = json_of(*table);
  const auto html = html_of(folder, *table);
  if (!html) return tl::unexpected(html.error());
  if (auto ok =
          write_file(folder + "/trade.json", json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
      !ok)
    return ok;
  if (auto ok = write_file(folder + "/trade.csv", csv_of(json)); !ok) return ok;
  return write_file(folder + "/index.html", *html);
}

}  // namespace selvedge
