// The page of a sweep: plots with the front drawn, tables with command lines and small pictures.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/report/chart.h"
#include "apps/report/trade.h"
#include "format/base/atomic_file.h"

namespace selvedge {
namespace {

using Json = nlohmann::ordered_json;

/// A picture as an address that contains it; empty where there is no picture.
std::string picture_data(const TradeFolder& folder, const std::string& name) {
  const auto bytes = read_file(folder.picture(name));
  return bytes ? png_address({reinterpret_cast<const std::uint8_t*>(bytes->data()), bytes->size()}) : "";
}

/// A column of numbers; `of_frames`: in both tables, else of fabrics alone.
struct Column {
  const char* title;
  const char* pointer;
  int digits;
  bool of_frames = true;
};
constexpr Column columns[] = {
    {"near", "/pictures/near/psnr", 2},   {"middle", "/pictures/middle/psnr", 2},
    {"far", "/pictures/far/psnr", 2},     {"grazing", "/pictures/grazing/psnr", 2},
    {"all, dB", trade_psnr, 2},           {"SSIM", "/pictures/all/ssim", 4},
    {"bytes", "/bytes", 0, false},        {"bake, s", "/seconds/bake", 2, false},
    {"fit, s", "/seconds/fit", 2, false}, {"all cores, s", "/processorSeconds", 2, false},
    {"load, ms", "/loadMs", 2},           {"frame, ms", "/frameMs", 2}};

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
  for (const Json& level : array_at(record, "heldOut")) {
    psnr = joined(psnr, " / ", fmt::format("{:.1f}", number_at(level, "/psnr")));
    relative = joined(relative, " / ", fmt::format("{:.3f}", number_at(level, "/relativeL2")));
  }
  return psnr + "<br>" + relative;
}

std::string table_of(const TradeFolder& folder, const Json& rows, const std::string& truth, bool fabrics) {
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
    for (const TradeCost& cost : trade_costs) {
      if (row["front"].value(cost.name, false)) front = joined(front, ", ", cost.words);
    }
    const std::string name = text_at(row, "name");
    const std::string quality = text_at(row, "quality");
    text += fmt::format("<tr{}><td>{}</td><td class=\"l\">{}{}<br><code>{}</code></td>",
                        front.empty() ? "" : " class=\"front\"", i + 1,
                        quality.empty() ? "" : fmt::format("<b>{}</b>: ", escaped(quality)),
                        escaped(knobs_text(object_at(row, "knobs"))), escaped(text_at(row, "command")));
    for (const Column& column : columns) {
      if (!fabrics && !column.of_frames) continue;
      const double value = number_at(row, column.pointer);
      text += std::isfinite(value) ? fmt::format("<td>{:.{}f}</td>", value, column.digits) : "<td>–</td>";
    }
    if (fabrics) text += fmt::format("<td class=\"l\">{}</td>", held_out_text(row));
    const std::string picture = picture_data(folder, name);
    text += fmt::format("<td class=\"l\">{}</td><td>", front);
    if (!picture.empty()) text += fmt::format("<img alt=\"{}\" src=\"{}\">", escaped(name), picture);
    text += "<br>" + truth + "</td></tr>\n";
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

std::string text_of_sweep(const Json& trade) {
  const Json identity = object_at(trade, "identity");
  const Json machine = object_at(identity, "machine");
  const Json truth = object_at(trade, "truth");
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

/// Records over a logarithmic axis of cost, numbered as in the table, with the front as a line of steps: the
/// best quality up to that cost. Records without a positive cost are left out; empty without any other.
std::string plot_of(const char* title, const char* below, const char* left, std::vector<V2d> figures) {
  for (V2d& f : figures) {
    if (!(f.x > 0)) f.x = NAN;
  }
  const std::vector<bool> on_front = pareto_front(figures);
  Series beaten{{}, blue, 0, 3.5, {}, {10, -5}};
  Series front{{}, vermilion, 0, 4.5, {}, {10, -5}};
  V2d low(HUGE_VAL, HUGE_VAL);
  V2d high(-HUGE_VAL, -HUGE_VAL);
  for (std::size_t i = 0; i < figures.size(); ++i) {
    const V2d& f = figures[i];
    if (!std::isfinite(f.x) || !std::isfinite(f.y)) continue;
    Series& series = on_front[i] ? front : beaten;
    series.points.push_back(f);
    series.labels.push_back(fmt::format("{}", i + 1));
    low = {std::min(low.x, f.x), std::min(low.y, f.y)};
    high = {std::max(high.x, f.x), std::max(high.y, f.y)};
  }
  if (front.points.empty()) return "";
  // A little air around the points.
  const double wide = std::pow(std::max(2.0, high.x / low.x), 0.06);
  const double tall = 0.06 * std::max(0.01, high.y - low.y);
  Chart chart{title,
              left,
              below,
              logarithmic_axis(low.x / wide, std::max(high.x, 2 * low.x) * wide),
              linear_axis(low.y - tall, std::max(high.y, low.y + 0.01) + tall),
              {}};
  std::vector<V2d> corners = front.points;
  std::sort(corners.begin(), corners.end(), [](const V2d& a, const V2d& b) { return a.x < b.x; });
  Series steps{{}, vermilion, 2, 0, {}, {}};
  for (const V2d& at : corners) {
    if (!steps.points.empty()) steps.points.emplace_back(at.x, steps.points.back().y);
    steps.points.push_back(at);
  }
  steps.points.emplace_back(chart.x.high, steps.points.back().y);
  chart.series = {steps, beaten, front};
  Svg svg;
  draw_chart(svg, {64, 56}, {472, 288}, chart);
  return svg.file(560, 400, title);
}

std::string plots_of(const Json& trade) {
  constexpr const char* pictures = "pictures, PSNR in dB";
  constexpr const char* held_out = "held out, finest level, dB";
  constexpr const char* held_out_psnr = "/heldOut/0/psnr";
  constexpr const char* bytes = "bytes of the file";
  constexpr const char* make = "seconds to bake and fit";
  const auto plot = [&](const char* title, const char* rows, const char* below, const char* cost,
                        const char* left, const char* quality) {
    return plot_of(title, below, left, trade_figures(trade[rows], cost, quality));
  };
  return plot("Pictures against bytes", "points", bytes, "/bytes", pictures, trade_psnr) +
         plot("Pictures against time to make", "points", make, "/seconds/make", pictures, trade_psnr) +
         plot("Pictures against time per frame", "points", "ms a frame", "/frameMs", pictures, trade_psnr) +
         plot("Held-out directions against bytes", "points", bytes, "/bytes", held_out, held_out_psnr) +
         plot("Held-out directions against time to make", "points", make, "/seconds/make", held_out,
              held_out_psnr) +
         plot("The viewer's settings", "frames", "ms a frame", "/frameMs", pictures, trade_psnr);
}

}  // namespace

std::string trade_page(const TradeFolder& folder, const Json& trade) {
  // The true picture stands beside each of the others and is embedded once.
  const std::string size =
      fmt::format(R"(width="{}" height="{}")", 4 * std::floor(number_at(trade, "/identity/size/0") / 2),
                  std::floor(number_at(trade, "/identity/size/1") / 2));
  const std::string truth = fmt::format("<svg {}><use href=\"#truth\"/></svg>", size);
  std::string text = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta "
      "charset=\"utf-8\"><title>{0}</title>\n{1}</head><body>\n"
      "<h1>{0}</h1>\n{2}<div class=\"plots\">\n{3}</div>\n<p>The line is the front: the best pictures up to "
      "that cost. Numbers are those of the tables, where settings on a front are coloured.</p>\n"
      "<svg width=\"0\" height=\"0\" style=\"position:absolute\"><defs><image id=\"truth\" {4} href=\"{5}\"/>"
      "</defs></svg>\n<h2>Fabrics</h2>\n{6}",
      escaped("Speed against accuracy: " + text_at(object_at(trade, "identity"), "stitch")), style,
      text_of_sweep(trade), plots_of(trade), size, picture_data(folder, trade_truth_picture),
      table_of(folder, trade["points"], truth, true));
  if (!trade["frames"].empty())
    text += "<h2>Settings of the viewer</h2>\n" + table_of(folder, trade["frames"], truth, false);
  return text + "</body></html>\n";
}

}  // namespace selvedge
