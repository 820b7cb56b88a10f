#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "apps/common/html.h"
#include "apps/selvedge-view/trade.h"

namespace selvedge {
namespace {

constexpr std::initializer_list<Column> columns{{"stitch", "{stitch}"},
                                                {"pixels a repeat", "{pixels}"},
                                                {"fabric", "{fabric}"},
                                                {"bytes", "{bytes}"},
                                                {"make, s", "{makeSeconds:.1f}"},
                                                {"picture", "{drawn}"},
                                                {"ms", "{ms:.0f}"},
                                                {"dB", "{db:.1f}"}};

constexpr const char* style = R"(<style>
body { font: 14px/1.45 "DejaVu Sans", Verdana, sans-serif; color: #1b1f24; margin: 24px; max-width: 960px; }
table { border-collapse: collapse; }
td, th { border-bottom: 1px solid #d0d5dc; padding: 3px 12px; text-align: right; }
tr.first td { border-top: 2px solid #1b1f24; }
div { display: grid; grid-template-columns: repeat(6, 1fr); gap: 8px; margin-top: 24px; }
figure { margin: 0; font-size: 12px; } figure:nth-child(13n+1) { grid-column: 1; } img { width: 100%; }
</style>
)";

/// Colours that the colour-blind can distinguish, too (Okabe and Ito 2008), from near to far.
constexpr std::array colours{"#d55e00", "#e69f00", "#009e73", "#0072b2"};

/// A scale of a side of a plot.
struct Scale {
  double low = 0, high = 1;  ///< of values; of their logarithms if `log`
  double from = 0, to = 1;   ///< px
  bool log = false;
  double at(double value) const {
    return from + (to - from) * ((log ? std::log10(value) : value) - low) / (high - low);
  }
};

std::string mark(const std::string& fabric, const std::string& drawn, double x, double y,
                 const char* colour) {
  const bool asked = drawn.starts_with("--");
  const char* const shape = asked                ? "M{:.1f},{:.1f}m0,-6l6,6l-6,6l-6,-6z"
                            : fabric == "texels" ? "M{:.1f},{:.1f}m-4,-4h8v8h-8z"
                            : fabric == "paper"
                                ? "M{:.1f},{:.1f}m0,-6l5,9h-10z"
                                : "M{:.1f},{:.1f}m-4.5,0a4.5,4.5 0 1 0 9,0a4.5,4.5 0 1 0 -9,0z";
  return fmt::format("<path d=\"{}\" fill=\"{}\" stroke=\"{}\" stroke-width=\"1.5\"/>",
                     fmt::format(fmt::runtime(shape), x, y), asked || fabric == "draft" ? "#fff" : colour,
                     colour);
}

std::string text(double x, double y, const char* anchor, const std::string& words) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>", x, y, anchor,
                     escape_html(words));
}

/// A panel of the plot over a member of the rows.
std::string panel(const std::vector<Json>& rows, const char* member, const std::string& label, Scale x,
                  const Scale& y) {
  x.log = true;
  x.low = HUGE_VAL;
  x.high = -HUGE_VAL;
  for (const Json& row : rows) {
    x.low = std::min(x.low, std::log10(row[member].get<double>()) - 0.1);
    x.high = std::max(x.high, std::log10(row[member].get<double>()) + 0.1);
  }
  std::string svg = text((x.from + x.to) / 2, y.from + 38, "middle", label);
  const auto line = [&](double x0, double y0, double x1, double y1, const char* stroke) {
    svg += fmt::format("<path d=\"M{:.1f},{:.1f}L{:.1f},{:.1f}\" stroke=\"{}\"/>", x0, y0, x1, y1, stroke);
  };
  for (int power = -1; power < 9; ++power) {
    for (const int digit : {1, 2, 5}) {
      const double value = digit * std::pow(10, power);
      if (std::log10(value) < x.low || std::log10(value) > x.high) continue;
      line(x.at(value), y.from, x.at(value), y.to, "#e4e7eb");
      svg += text(x.at(value), y.from + 18, "middle",
                  value < 1e4 ? fmt::format("{:g}", value) : fmt::format("{:g}K", value / 1000));
    }
  }
  for (double db = y.low; db <= y.high; db += 5) {
    line(x.from, y.at(db), x.to, y.at(db), db == y.low ? "#1b1f24" : "#e4e7eb");
    svg += text(x.from - 8, y.at(db) + 4, "end", fmt::format("{:g}", db));
  }
  int pixels = 0;
  int colour = -1;
  bool begins = true;
  std::string path;
  std::string marks;
  for (const Json& row : rows) {
    if (row["pixels"] != pixels) {
      ++colour;
      begins = true;
    }
    pixels = row["pixels"];
    const double at_x = x.at(row[member]);
    const double at_y = y.at(row["db"]);
    if (row["fabric"] == "yarn" && !row["drawn"].get<std::string>().starts_with("--"))
      path += fmt::format("{}{:.1f},{:.1f}", std::exchange(begins, false) ? "M" : "L", at_x, at_y);
    marks += mark(row["fabric"], row["drawn"], at_x, at_y, colours[colour % colours.size()]) + "\n";
  }
  return svg + fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"#8a929c\"/>\n", path) + marks;
}

}  // namespace

std::string trade_text(const Json& rows) { return table_text(rows, columns); }

std::string trade_plot(const Json& rows) {
  Scale y{HUGE_VAL, -HUGE_VAL, 330, 20};
  std::vector<Json> by_time(rows.begin(), rows.end());
  for (const Json& row : rows) {
    y.low = std::min(y.low, 5 * std::floor(row["db"].get<double>() / 5));
    y.high = std::max(y.high, 5 * std::ceil(row["db"].get<double>() / 5));
  }
  y.high = std::max(y.high, y.low + 5);
  std::ranges::stable_sort(by_time, [](const Json& a, const Json& b) {
    return std::pair(-a["pixels"].get<double>(), a["ms"].get<double>()) <
           std::pair(-b["pixels"].get<double>(), b["ms"].get<double>());
  });
  std::vector<Json> at_rest;
  std::ranges::copy_if(by_time, std::back_inserter(at_rest),
                       [](const Json& row) { return row["drawn"] == "2 x 2 rays"; });
  std::string svg =
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 960 440\" font-family=\"DejaVu Sans, Verdana, "
      "sans-serif\" font-size=\"12\" fill=\"#1b1f24\">\n<rect width=\"960\" height=\"440\" "
      "fill=\"#fff\"/>\n" +
      text(44, 12, "end", "dB") + panel(by_time, "ms", "ms of processor for a picture", {0, 1, 50, 590}, y) +
      panel(at_rest, "bytes", "bytes of the fabric, at rest", {0, 1, 650, 940}, y);
  double x = 50;
  const auto legend = [&](const std::string& words, const std::string& shape) {
    svg += shape + text(x + 10, 404, "start", words);
    x += 24 + 7.4 * static_cast<double>(words.size());
  };
  std::size_t colour = 0;
  int pixels = 0;
  for (const Json& row : rows) {
    if (row["pixels"] == pixels) continue;
    pixels = row["pixels"];
    legend(fmt::format("{} px a repeat", pixels),
           mark("yarn", "", x, 400, colours[colour++ % colours.size()]));
  }
  x = 50;
  svg += "<g transform=\"translate(0 24)\">";
  for (const char* fabric : {"yarn", "draft", "texels", "paper"})
    legend(fabric, mark(fabric, "", x, 400, "#1b1f24"));
  legend("chosen by --accuracy, --seconds", mark("", "--", x, 400, "#1b1f24"));
  legend("the line: yarn moving, then at rest with 1, 4, 16 rays a pixel", "");
  return svg + "</g></svg>\n";
}

std::string trade_page(const std::string& words, const std::vector<TradeSection>& sections) {
  std::string page = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta "
      "charset=\"utf-8\"><title>The trade</title>\n{}</head><body>\n<p>{}</p>\n",
      style, escape_html(words));
  for (const auto& [stitch, rows, pictures] : sections) {
    page += fmt::format("<h1>{}: the trade</h1>\n{}<table>\n<tr>", escape_html(stitch), trade_plot(rows));
    for (const Column& column : columns) page += fmt::format("<th>{}</th>", column.heading);
    int pixels = 0;
    for (const Json& row : rows) {
      page += row["pixels"] == pixels ? "</tr>\n<tr>" : "</tr>\n<tr class=\"first\">";
      pixels = row["pixels"];
      for (const Column& column : columns)
        page += fmt::format("<td>{}</td>", escape_html(fill_pattern(column.pattern, row)));
    }
    page += "</tr>\n</table>\n<div>\n";
    for (const TradePicture& picture : pictures)
      page += fmt::format(
          "<figure><img alt=\"\" src=\"data:image/png;base64,{}\"><figcaption>{}</figcaption></figure>\n",
          base64(picture.png), escape_html(picture.caption));
    page += "</div>\n";
  }
  return page + "</body></html>\n";
}

}  // namespace selvedge
