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

/// Where something is on the front of a plot.
struct Fronts {
  std::vector<bool> bytes, make, work, frame;
};

std::vector<TradeFigure> figures(const std::vector<TradeRow>& rows, double TradeRow::*cost,
                                 double TradeRow::*quality) {
  std::vector<TradeFigure> result;
  for (const TradeRow& row : rows) result.push_back({row.*cost, row.*quality});
  return result;
}

Fronts fronts_of(const std::vector<TradeRow>& rows) {
  return {pareto_front(figures(rows, &TradeRow::bytes, &TradeRow::picture)),
          pareto_front(figures(rows, &TradeRow::make, &TradeRow::picture)),
          pareto_front(figures(rows, &TradeRow::work, &TradeRow::picture)),
          pareto_front(figures(rows, &TradeRow::frame, &TradeRow::picture))};
}

Json json_of(const TradeTable& table) {
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

/// The address of a picture that is the picture itself, or nothing where there is none.
std::string picture_data(const std::string& folder, const std::string& name) {
  const auto bytes = read_file(fmt::format("{}/{}/{}.png", folder, trade_pictures_folder, name));
  if (!bytes) return "";
  const std::span<const char> chars(*bytes);
  return "data:image/png;base64," + base64(std::vector<std::uint8_t>(chars.begin(), chars.end()));
}

std::string picture(const std::string& folder, const std::string& name) {
  const std::string data = picture_data(folder, name);
  return data.empty() ? "" : fmt::format(R"(<img alt="{}" src="{}">)", escaped(name), data);
}

Result<std::string> plot(const char* title, const char* cost_text, const char* quality_text,
                         const std::vector<TradeRow>& rows, double TradeRow::*cost,
                         double TradeRow::*quality) {
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

std::string rows_of(const std::string& folder, const std::vector<TradeRow>& rows, const std::string& truth,
                    bool fabrics) {
  const Fronts fronts = fronts_of(rows);
  std::string text;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const TradeRow& row = rows[i];
    std::string front;
    const auto add = [&](bool on, const char* what) {
      if (on) front += fmt::format("{}{}", front.empty() ? "" : ", ", what);
    };
    add(fronts.bytes[i], "bytes");
    add(fronts.make[i], "time to make");
    add(fronts.work[i], "work of all cores");
    add(fronts.frame[i], "frame");
    const Json knobs = object_at(row.record, "knobs");
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

std::string text_of_sweep(const TradeTable& table) {
  const Json identity = object_at(table.sweep, "identity");
  const Json machine = object_at(identity, "machine");
  std::string noise;
  const Json truth = object_at(table.sweep, "truth");
  for (const auto& [view, value] : truth.items()) {
    const double psnr = number_at(value, "/noisePsnr");
    noise += fmt::format("{}{} {}", noise.empty() ? "" : ", ", view,
                         std::isfinite(psnr) ? fmt::format("{:.1f} dB", psnr) : "none");
  }
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

Result<std::string> html_of(const std::string& folder, const TradeTable& table) {
  const std::string title =
      fmt::format("Speed against accuracy: {}", text_at(object_at(table.sweep, "identity"), "stitch"));
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
                          &TradeRow::bytes, &TradeRow::picture),
                     plot("Pictures against time to make", "seconds to bake and fit", picture_error,
                          table.fabrics, &TradeRow::make, &TradeRow::picture),
                     plot("Pictures against time per frame", "ms a frame", picture_error, table.fabrics,
                          &TradeRow::frame, &TradeRow::picture),
                     plot("Held-out directions against bytes", "bytes of the file", held_out_error,
                          table.fabrics, &TradeRow::bytes, &TradeRow::held_out),
                     plot("Held-out directions against time to make", "seconds to bake and fit",
                          held_out_error, table.fabrics, &TradeRow::make, &TradeRow::held_out),
                     plot("The viewer's settings", "ms a frame", picture_error, table.frames,
                          &TradeRow::frame, &TradeRow::picture)}) {
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
  const auto table = read_trade_table(folder);
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
