#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <tuple>

#include "apps/common/html.h"
#include "apps/selvedge-view/trade.h"

namespace selvedge {
namespace {

/// NaN where the row has no such number.
double number_of(const Json& row, const char* member) {
  return row.contains(member) && row[member].is_number() ? row[member].get<double>() : NAN;
}

std::string field(const Json& value) {
  std::string text = value.is_null() ? "" : value.is_string() ? value.get<std::string>() : value.dump();
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

/// The records of a CSV file, with quotes taken away.
std::vector<std::vector<std::string>> records_of(const std::string& csv) {
  std::vector<std::vector<std::string>> records(1, {""});
  bool quoted = false;
  for (std::size_t i = 0; i < csv.size(); ++i) {
    const char c = csv[i];
    std::string& value = records.back().back();
    if (quoted && c == '"' && i + 1 < csv.size() && csv[i + 1] == '"') {
      value += csv[++i];
    } else if (c == '"') {
      quoted = !quoted;
    } else if (quoted || (c != ',' && c != '\n' && c != '\r')) {
      value += c;
    } else if (c == ',') {
      records.back().emplace_back();
    } else if (c == '\n') {
      records.push_back({""});
    }
  }
  std::erase(records, std::vector<std::string>{""});
  return records;
}

/// A logarithmic or linear axis of a plot: from a value to pixels, and its ticks.
struct Axis {
  bool logarithmic;
  double low, high;
  double from, to;  ///< pixels

  double operator()(double value) const {
    const auto share = [&](double v) { return logarithmic ? std::log(v) : v; };
    return from + (to - from) * (share(value) - share(low)) / (share(high) - share(low));
  }
  std::vector<double> ticks() const {
    std::vector<double> ticks;
    const double step = std::pow(10, std::floor(std::log10(logarithmic ? low : high - low)));
    if (logarithmic) {
      for (double unit = step; unit <= high; unit *= 10) {
        for (const double tick : {unit, 2 * unit, 5 * unit}) {
          if (tick >= low && tick <= high) ticks.push_back(tick);
        }
      }
      return ticks;
    }
    const double width = high - low > 5 * step ? step : step / 2;
    for (double tick = std::ceil(low / width) * width; tick <= high; tick += width) ticks.push_back(tick);
    return ticks;
  }
};

std::string tick_text(double value) {
  return value >= 1e6   ? fmt::format("{:g} M", value / 1e6)
         : value >= 1e3 ? fmt::format("{:g} k", value / 1e3)
                        : fmt::format("{:.4g}", value);
}

std::string text_at(double x, double y, const char* anchor, const std::string& text) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n", x, y, anchor,
                     escaped(text));
}

/// The rows as numbered points over a logarithmic axis of cost; the front is coloured and joined by a line.
/// Empty without a row that has both figures.
std::string plot_of(const Json& rows, const char* cost, const char* cost_words, const char* quality,
                    const char* quality_words) {
  std::vector<V2d> points;
  V2d low(HUGE_VAL, HUGE_VAL);
  V2d high(-HUGE_VAL, -HUGE_VAL);
  for (const Json& row : rows) {
    V2d p(number_of(row, cost), number_of(row, quality));
    if (!(p.x > 0) || !std::isfinite(p.y)) p = {NAN, NAN};
    points.push_back(p);
    if (!std::isfinite(p.x)) continue;
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
  if (!(low.x <= high.x)) return "";
  const double air = 0.08 * (high.y - low.y) + 0.1;
  const Axis x{true, low.x / 1.2, high.x * 1.2, 50, 470};
  const Axis y{false, low.y - air, high.y + air, 270, 30};
  std::string svg =
      fmt::format(
          "<svg width=\"490\" height=\"315\">\n<rect x=\"50\" y=\"30\" width=\"420\" height=\"240\"/>\n") +
      text_at(260, 305, "middle", cost_words) + text_at(50, 20, "start", quality_words);
  for (const double tick : x.ticks()) {
    svg += fmt::format("<path d=\"M{0:.1f} 30V270\"/>\n", x(tick)) +
           text_at(x(tick), 286, "middle", tick_text(tick));
  }
  for (const double tick : y.ticks()) {
    svg += fmt::format("<path d=\"M50 {0:.1f}H470\"/>\n", y(tick)) +
           text_at(45, y(tick) + 4, "end", tick_text(tick));
  }
  const std::vector<bool> front = pareto_front(points);
  std::vector<V2d> corners;
  std::string dots;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const V2d& p = points[i];
    if (!std::isfinite(p.x)) continue;
    if (front[i]) corners.push_back(p);
    dots += fmt::format("<circle class=\"{}\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\"/>\n",
                        front[i] ? "front" : "beaten", x(p.x), y(p.y)) +
            text_at(x(p.x) + 6, y(p.y) - 5, "start", std::to_string(i + 1));
  }
  std::sort(corners.begin(), corners.end(), [](const V2d& a, const V2d& b) { return a.x < b.x; });
  std::string line = fmt::format("M{:.1f} {:.1f}", x(corners.front().x), y(corners.front().y));
  for (const V2d& corner : corners) line += fmt::format("H{:.1f}V{:.1f}", x(corner.x), y(corner.y));
  return svg + fmt::format("<path class=\"front\" d=\"{}H470\"/>\n", line) + dots + "</svg>\n";
}

constexpr const char* style = R"(<style>
body { font: 14px/1.45 "DejaVu Sans", Verdana, sans-serif; color: #1b1f24; margin: 24px; }
table { border-collapse: collapse; font-size: 12px; }
td, th { border-bottom: 1px solid #d0d5dc; padding: 4px 8px; text-align: right; vertical-align: top; }
td.l { text-align: left; max-width: 480px; overflow-wrap: anywhere; }
svg { font-size: 12px; fill: #1b1f24; } svg rect { fill: #f6f7f9; } svg path { stroke: #d0d5dc; fill: none; }
svg path.front { stroke: #d55e00; stroke-width: 2; } .front { fill: #d55e00; } .beaten { fill: #0072b2; }
</style>
)";

}  // namespace

const Json* chosen_row(const Json& rows, const TradeLimits& limits) {
  const Json* best = nullptr;
  const auto rank = [&](const Json& row) {
    const double picture = number_of(row, figures::picture);
    const double seconds = number_of(row, figures::seconds);
    const double bytes = number_of(row, figures::bytes);
    return limits.picture ? std::tuple(seconds, bytes, -picture) : std::tuple(-picture, seconds, bytes);
  };
  for (const Json& row : rows) {
    const bool meets =
        std::isfinite(number_of(row, figures::picture)) &&
        (!limits.bytes || number_of(row, figures::bytes) <= static_cast<double>(*limits.bytes)) &&
        (!limits.picture || number_of(row, figures::picture) >= *limits.picture) &&
        (!limits.seconds || number_of(row, figures::seconds) <= *limits.seconds);
    if (meets && (best == nullptr || rank(row) < rank(*best))) best = &row;
  }
  return best;
}

std::string csv_of(const Json& rows) {
  std::string text;
  for (const auto& [name, value] : rows.at(0).items()) text.append(text.empty() ? "" : ",").append(name);
  for (const Json& row : rows) {
    std::string line;
    for (const auto& [name, value] : row.items()) line.append(line.empty() ? "\n" : ",").append(field(value));
    text += line;
  }
  return text + "\n";
}

Result<Json> rows_of(const std::string& csv, const std::string& name) {
  const auto records = records_of(csv);
  Json rows = Json::array();
  for (std::size_t i = 1; i < records.size(); ++i) {
    if (records[i].size() != records[0].size())
      return fail(Code::option_out_of_range, name, fmt::format("record {}", i + 1),
                  fmt::format("has {} fields, not {}", records[i].size(), records[0].size()));
    Json& row = rows.emplace_back(Json::object());
    for (std::size_t k = 0; k < records[0].size(); ++k) {
      const std::string& value = records[i][k];
      char* end = nullptr;
      const double number = std::strtod(value.c_str(), &end);
      row[records[0][k]] = value.empty() ? Json() : *end == '\0' ? Json(number) : Json(value);
    }
  }
  for (const char* member : {figures::bytes, figures::seconds, figures::picture}) {
    if (rows.empty() || !rows[0].contains(member))
      return fail(Code::option_out_of_range, name, member, "the table of a sweep has such a column");
  }
  return rows;
}

std::vector<bool> pareto_front(const std::vector<V2d>& points) {
  std::vector<bool> front;
  for (const V2d& a : points) {
    // Comparisons with NaN are false.
    front.push_back(std::isfinite(a.x) && std::isfinite(a.y) &&
                    std::none_of(points.begin(), points.end(), [&](const V2d& b) {
                      return b.x <= a.x && b.y >= a.y && (b.x < a.x || b.y > a.y);
                    }));
  }
  return front;
}

std::string trade_page(const std::string& title, const Json& rows, const std::vector<std::string>& pictures,
                       const std::string& truth) {
  constexpr const char* picture_words = "picture beside the traced stitch, dB";
  std::string page = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta "
      "charset=\"utf-8\"><title>{0}</title>\n{1}</head><body>\n<h1>{0}</h1>\n",
      escaped(title), style);
  page += plot_of(rows, figures::bytes, "bytes of the file", figures::picture, picture_words) +
          plot_of(rows, figures::seconds, "seconds to make", figures::picture, picture_words) +
          plot_of(rows, figures::frame, "ms a frame, all cores", figures::picture, picture_words) +
          plot_of(rows, figures::bytes, "bytes of the file", figures::held_out, "held-out directions, dB");
  page += "<p>The line joins the best up to each cost; numbers are rows of the table.</p>\n<table>\n";
  const auto image = [](const std::string& png) {
    return png.empty() ? std::string()
                       : fmt::format("<img alt=\"\" src=\"data:image/png;base64,{}\">",
                                     base64({reinterpret_cast<const std::uint8_t*>(png.data()), png.size()}));
  };
  if (!truth.empty())
    page += "<tr><td></td><td class=\"l\">the stitch, traced</td><td>" + image(truth) + "</td></tr>\n";
  page +=
      "<tr><th>#</th><th>setting</th><th>picture</th><th>bytes</th><th>make, s</th><th>frame, "
      "ms</th><th>held out, "
      "dB</th><th>picture, dB</th></tr>\n";
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto cell = [&](const char* pattern) { return escaped(filled(pattern, rows[i])); };
    page += fmt::format(
        "<tr><td>{}</td><td "
        "class=\"l\">{}<br><code>{}<br>{}</code></td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}"
        "</td><td>{}</td></tr>\n",
        i + 1, cell("{setting}"), cell("{make}"), cell("{render}"), image(pictures[i]), cell("{bytes}"),
        cell("{seconds:.2f}"), cell("{frameMs:.1f}"), cell("{heldOutDb:.2f}"), cell("{pictureDb:.2f}"));
  }
  return page + "</table></body></html>\n";
}

}  // namespace selvedge
