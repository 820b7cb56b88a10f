#include "apps/report/trade_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/report/markup.h"
#include "apps/report/trade_plot.h"
#include "apps/report/trade_records.h"
#include "format/base/atomic_file.h"

namespace selvedge {
namespace {

using Json = nlohmann::ordered_json;

/// Costs that pictures are weighed against: the name in a record's `front`, where the cost stands, and its
/// words.
struct Cost {
  const char* name;
  const char* pointer;
  const char* words;
};
constexpr Cost costs[] = {{"bytes", "/bytes", "bytes"},
                          {"make", "/seconds/make", "time to make"},
                          {"work", "/processorSeconds", "work of all cores"},
                          {"frame", "/frameMs", "frame"}};
constexpr const char* picture_psnr = "/pictures/all/psnr";

std::vector<TradeFigure> figures(const Json& rows, const char* cost, const char* quality) {
  std::vector<TradeFigure> result;
  for (const Json& row : rows) result.push_back({number_at(row, cost), number_at(row, quality)});
  return result;
}

/// The records as an array, each with the fronts that it lies on.
Json with_fronts(const std::vector<Json>& records, bool fabrics) {
  Json rows = Json::array();
  for (const Json& record : records) rows.push_back(record);
  for (const Cost& cost : costs) {
    if (!fabrics && cost.name != std::string_view("frame")) continue;
    const std::vector<bool> front = pareto_front(figures(rows, cost.pointer, picture_psnr));
    for (std::size_t i = 0; i < front.size(); ++i) rows[i]["front"][cost.name] = bool{front[i]};
  }
  return rows;
}

Json json_of(const TradeTable& table) {
  Json all = {{"program", "selvedge"}, {"report", 1}, {"verb", "trade"}};
  all.update(table.sweep);
  all["points"] = with_fronts(table.fabrics, true);
  all["frames"] = with_fronts(table.frames, false);
  if (!table.presets.empty()) all["framePresets"] = table.presets;
  return all;
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
std::string csv_of(const Json& all) {
  Json columns = Json::object();
  std::vector<Json> rows;
  for (const char* kind : {"points", "frames"}) {
    for (const Json& record : all[kind]) {
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

/// A picture as an address that contains it; empty where there is no picture.
std::string picture_data(const std::string& folder, const std::string& name) {
  const auto bytes = read_file(fmt::format("{}/{}/{}.png", folder, trade_pictures_folder, name));
  if (!bytes) return "";
  return "data:image/png;base64," + base64(std::vector<std::uint8_t>(bytes->begin(), bytes->end()));
}

std::string picture(const std::string& folder, const std::string& name) {
  const std::string data = picture_data(folder, name);
  return data.empty() ? "" : fmt::format(R"(<img alt="{}" src="{}">)", escaped(name), data);
}

/// The true picture, which stands beside each of the others and is embedded once.
struct TruthPicture {
  std::string definition;
  std::string use;
};

TruthPicture truth_picture(const std::string& folder, const Json& sweep) {
  const std::string data = picture_data(folder, trade_truth_picture);
  const double width = 4 * std::floor(number_at(sweep, "/identity/size/0") / 2);
  const double height = std::floor(number_at(sweep, "/identity/size/1") / 2);
  if (data.empty() || !(width > 0 && height > 0)) return {};
  return {
      fmt::format(
          R"(<svg width="0" height="0" style="position:absolute"><defs><image id="truth" width="{}" height="{}" href="{}"/></defs></svg>)",
          width, height, data),
      fmt::format(R"(<svg width="{}" height="{}"><use href="#truth"/></svg>)", width, height)};
}

/// A column of numbers in both tables, or of fabrics alone.
struct Column {
  const char* title;
  const char* pointer;
  const char* form;
  bool of_frames = true;
};
constexpr Column columns[] = {
    {"near", "/pictures/near/psnr", "{:.2f}"},   {"middle", "/pictures/middle/psnr", "{:.2f}"},
    {"far", "/pictures/far/psnr", "{:.2f}"},     {"grazing", "/pictures/grazing/psnr", "{:.2f}"},
    {"all, dB", picture_psnr, "{:.2f}"},         {"SSIM", "/pictures/all/ssim", "{:.4f}"},
    {"bytes", "/bytes", "{:.0f}", false},        {"bake, s", "/seconds/bake", "{:.2f}", false},
    {"fit, s", "/seconds/fit", "{:.2f}", false}, {"all cores, s", "/processorSeconds", "{:.2f}", false},
    {"load, ms", "/loadMs", "{:.2f}"},           {"frame, ms", "/frameMs", "{:.2f}"}};

std::string joined(const std::string& list, const std::string& separator, const std::string& next) {
  return list.empty() ? next : list + separator + next;
}

std::string knobs_text(const Json& knobs) {
  std::string text;
  for (const auto& [name, value] : knobs.items())
    text = joined(text, ", ", name + " " + (value.is_string() ? value.get<std::string>() : value.dump()));
  return text;
}

/// Held-out errors of all levels: a line of decibels and one of relative errors.
std::string held_out_text(const Json& record) {
  std::string psnr;
  std::string relative;
  for (const Json& level : record.value("heldOut", Json::array())) {
    psnr = joined(psnr, " / ", fmt::format("{:.1f}", number_at(level, "/psnr")));
    relative = joined(relative, " / ", fmt::format("{:.3f}", number_at(level, "/relativeL2")));
  }
  return psnr + "<br>" + relative;
}

std::string table_of(const std::string& folder, const Json& rows, const std::string& truth, bool fabrics) {
  std::string text = "<table><tr><th>#</th><th class=\"l\">knobs, command</th>";
  for (const Column& column : columns) {
    if (fabrics || column.of_frames) text += fmt::format("<th>{}</th>", column.title);
  }
  if (fabrics) text += "<th class=\"l\">held out, dB and relative L2 by level</th>";
  text +=
      "<th class=\"l\">on the front of</th><th class=\"l\">near, middle, far, grazing; the truth "
      "below</th></tr>\n";
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Json& row = rows[i];
    std::string front;
    for (const Cost& cost : costs) {
      if (row["front"].value(cost.name, false)) front = joined(front, ", ", cost.words);
    }
    const std::string quality = text_at(row, "quality");
    text += fmt::format("<tr{}><td>{}</td><td class=\"l\">{}{}<br><code>{}</code></td>",
                        front.empty() ? "" : " class=\"front\"", i + 1,
                        quality.empty() ? "" : fmt::format("<b>{}</b>: ", escaped(quality)),
                        escaped(knobs_text(object_at(row, "knobs"))), escaped(text_at(row, "command")));
    for (const Column& column : columns) {
      if (!fabrics && !column.of_frames) continue;
      const double value = number_at(row, column.pointer);
      text += fmt::format("<td>{}</td>",
                          std::isfinite(value) ? fmt::format(fmt::runtime(column.form), value) : "–");
    }
    if (fabrics) text += fmt::format("<td class=\"l\">{}</td>", held_out_text(row));
    text += fmt::format("<td class=\"l\">{}</td><td>{}<br>{}</td></tr>\n", front,
                        picture(folder, text_at(row, "name")), truth);
  }
  return text + "</table>\n";
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

std::string text_of_sweep(const Json& sweep) {
  const Json identity = object_at(sweep, "identity");
  const Json machine = object_at(identity, "machine");
  const Json truth = object_at(sweep, "truth");
  std::string noise;
  for (const auto& [view, value] : truth.items()) {
    const double psnr = number_at(value, "/noisePsnr");
    noise = joined(noise, ", ", view + " " + (std::isfinite(psnr) ? fmt::format("{:.1f} dB", psnr) : "none"));
  }
  return fmt::format(
      "<p>{} by {}. Measured on {}, {} cores, {} threads; times are medians of {} runs, all points of one "
      "sweep. Pictures of {} x {} pixels against the traced stitch, {} rays a pixel, in sRGB after exposure; "
      "the truth's own noise would make {}. Held-out errors against {} pairs of directions at {} "
      "texels, {} rays each, from the finest level to the mean of the cell.</p>\n",
      escaped(text_at(identity, "stitch")), escaped(text_at(identity, "software")),
      escaped(text_at(machine, "processor")), number_at(machine, "/cores"), number_at(machine, "/threads"),
      number_at(identity, "/repeats"), number_at(identity, "/size/0"), number_at(identity, "/size/1"),
      number_at(identity, "/truthSamples"), escaped(noise), number_at(identity, "/heldOut/pairs"),
      number_at(identity, "/heldOut/texels"), number_at(identity, "/heldOut/samples"));
}

/// The plots, without those that have nothing to show.
Result<std::string> plots_of(const Json& all) {
  constexpr const char* pictures = "pictures, PSNR in dB";
  constexpr const char* held_out = "held out, finest level, dB";
  constexpr const char* held_out_psnr = "/heldOut/0/psnr";
  struct Plot {
    const char* title;
    const char* rows;
    const char* cost_text;
    const char* cost;
    const char* quality_text;
    const char* quality;
  };
  constexpr Plot plots[] = {
      {"Pictures against bytes", "points", "bytes of the file", "/bytes", pictures, picture_psnr},
      {"Pictures against time to make", "points", "seconds to bake and fit", "/seconds/make", pictures,
       picture_psnr},
      {"Pictures against time per frame", "points", "ms a frame", "/frameMs", pictures, picture_psnr},
      {"Held-out directions against bytes", "points", "bytes of the file", "/bytes", held_out, held_out_psnr},
      {"Held-out directions against time to make", "points", "seconds to bake and fit", "/seconds/make",
       held_out, held_out_psnr},
      {"The viewer's settings", "frames", "ms a frame", "/frameMs", pictures, picture_psnr}};
  std::string text;
  for (const Plot& plot : plots) {
    const Drawing drawing = trade_plot(
        {plot.title, plot.cost_text, plot.quality_text, figures(all[plot.rows], plot.cost, plot.quality)});
    if (drawing.shapes.empty()) continue;
    auto svg = svg_of(drawing);
    if (!svg) return svg;
    text += *svg;
  }
  return text;
}

Result<std::string> html_of(const std::string& folder, const Json& all) {
  auto plots = plots_of(all);
  if (!plots) return plots;
  const std::string title =
      escaped("Speed against accuracy: " + text_at(object_at(all, "identity"), "stitch"));
  const TruthPicture truth = truth_picture(folder, all);
  std::string text = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta "
      "charset=\"utf-8\"><title>{0}</title>\n{1}</head><body>\n"
      "<h1>{0}</h1>\n{2}<div class=\"plots\">\n{3}</div>\n<p>The line is the front: the best pictures up to "
      "that "
      "cost. Numbers are those of the tables, where settings on a front are coloured.</p>\n{4}\n"
      "<h2>Fabrics</h2>\n{5}",
      title, style, text_of_sweep(all), *plots, truth.definition,
      table_of(folder, all["points"], truth.use, true));
  if (!all["frames"].empty())
    text += "<h2>Settings of the viewer</h2>\n" + table_of(folder, all["frames"], truth.use, false);
  return text + "</body></html>\n";
}

}  // namespace

std::vector<bool> pareto_front(const std::vector<TradeFigure>& figures) {
  std::vector<bool> front;
  for (const TradeFigure& a : figures) {
    // Comparisons with what is not finite are false.
    front.push_back(std::isfinite(a.cost) && std::isfinite(a.quality) &&
                    std::none_of(figures.begin(), figures.end(), [&](const TradeFigure& b) {
                      return b.cost <= a.cost && b.quality >= a.quality &&
                             (b.cost < a.cost || b.quality > a.quality);
                    }));
  }
  return front;
}

Result<void> write_trade_page(const std::string& folder) {
  const auto table = read_trade_table(folder);
  if (!table) return tl::unexpected(table.error());
  const Json json = json_of(*table);
  const auto html = html_of(folder, json);
  if (!html) return tl::unexpected(html.error());
  if (auto ok =
          write_file(folder + "/trade.json", json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
      !ok)
    return ok;
  if (auto ok = write_file(folder + "/trade.csv", csv_of(json)); !ok) return ok;
  return write_file(folder + "/index.html", *html);
}

}  // namespace selvedge
