#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "apps/common/html.h"
#include "apps/selvedge-view/trade.h"

namespace selvedge {
namespace {

constexpr std::initializer_list<Column> columns{{"pixels a repeat", "{pixels}"},
                                                {"quality", "{quality}"},
                                                {"bytes", "{bytes}"},
                                                {"make, s", "{makeSeconds:.0f}"},
                                                {"moving, ms", "{movingMs:.0f}"},
                                                {"moving, dB", "{movingDb:.1f}"},
                                                {"at rest, dB", "{restDb:.1f}"},
                                                {"front", "{front}"}};

constexpr const char* style = R"(<style>
body { font: 14px/1.45 "DejaVu Sans", Verdana, sans-serif; color: #1b1f24; margin: 24px; max-width: 900px; }
table { border-collapse: collapse; }
td, th { border-bottom: 1px solid #d0d5dc; padding: 3px 12px; text-align: right; }
tr.first td { border-top: 2px solid #1b1f24; }
div { display: grid; grid-template-columns: repeat(4, 1fr); gap: 8px; margin-top: 24px; }
figure { margin: 0; font-size: 12px; } figure:nth-child(7n+1) { grid-row: span 2; } img { width: 100%; }
</style>
)";

}  // namespace

void mark_front(Json& rows) {
  const auto is_beaten = [](const Json& by, const Json& row) {
    const auto figures = [](const Json& line) {
      return std::array{-line["bytes"].get<double>(), line["movingDb"].get<double>(),
                        line["restDb"].get<double>()};
    };
    const auto a = figures(by);
    const auto b = figures(row);
    return by["pixels"] == row["pixels"] && a != b && std::ranges::equal(a, b, std::greater_equal<>());
  };
  for (Json& row : rows)
    row["front"] = std::ranges::none_of(rows, [&](const Json& by) { return is_beaten(by, row); });
}

std::string front_words(const Json& rows) {
  Json distances;
  for (const Json& row : rows) {
    Json& at = distances[row["quality"].get<std::string>()];
    if (row["front"]) at.push_back(row["pixels"]);
  }
  std::vector<std::string> words;
  for (const auto& [quality, at] : distances.items())
    words.push_back(quality + (at.empty()
                                   ? " nowhere"
                                   : fmt::format(" at {}", fmt::join(at.get<std::vector<int>>(), ", "))));
  return fmt::format("On the front, where none has fewer bytes and more dB: {}.", fmt::join(words, "; "));
}

std::string trade_text(const Json& rows) { return table_text(rows, columns); }

std::string trade_page(const std::string& title, const std::string& words, const Json& rows,
                       const std::vector<TradePicture>& pictures) {
  std::string page = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta "
      "charset=\"utf-8\"><title>{0}</title>\n{1}</head><body>\n"
      "<h1>{0}</h1>\n<p>{2}</p>\n<table>\n<tr>",
      escaped(title), style, escaped(words));
  for (const Column& column : columns) page += fmt::format("<th>{}</th>", column.heading);
  int pixels = 0;
  for (const Json& row : rows) {
    page += row["pixels"] == pixels ? "</tr>\n<tr>" : "</tr>\n<tr class=\"first\">";
    pixels = row["pixels"];
    for (const Column& column : columns)
      page += fmt::format("<td>{}</td>", escaped(filled(column.pattern, row)));
  }
  page += "</tr>\n</table>\n<div>\n";
  for (const TradePicture& picture : pictures)
    page += fmt::format(
        "<figure><img alt=\"\" src=\"data:image/png;base64,{}\"><figcaption>{}</figcaption></figure>\n",
        base64(picture.png), escaped(picture.words));
  return page + "</div></body></html>\n";
}

}  // namespace selvedge
