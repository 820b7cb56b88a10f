#include "converter/stitch/text_cells.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include "converter/stitch/chart.h"
#include "converter/stitch/library.h"
#include "converter/stitch/pattern_json.h"
#include "converter/stitch/text_fault.h"
#include "converter/stitch/wif.h"
#include "format/base/atomic_file.h"
#include "format/base/foreign.h"
#include "format/base/guard.h"
#include "format/base/option_text.h"
#include "format/picture/image.h"
#include "format/picture/picture_type.h"

namespace selvedge {

StitchText kind_of_text(const std::string& text, const std::string& path) {
  if (is_wif(text) || has_ending(path, ".wif")) return StitchText::draft;
  const bool is_chart = has_ending(path, ".txt") || has_ending(path, ".png");
  return is_chart ? StitchText::chart : StitchText::description;
}

std::string stitch_text_in(const std::string& path) {
  const auto text = read_file(path, std::max(max_wif_bytes, max_stitch_bytes));
  if (text && text->starts_with("\x89PNG\r\n")) return chart_of_picture(*text, path);
  if (text && !foreign_file_message(*text).empty())
    throw Failure{{Code::stitch_invalid, path, "", std::string(foreign_file_message(*text))}};
  if (text || text.error().code != Code::file_missing) return value_or_throw(text);
  std::string names;
  for (const StitchEntry& stitch : built_in_entries()) names += (names.empty() ? "" : ", ") + stitch.name;
  throw Failure{
      {Code::stitch_unknown, path, "", "no such file and no such built-in stitch (there are " + names + ")"}};
}

nlohmann::ordered_json chart_or_draft_json(const std::string& path) {
  const auto text = catch_failure([&] { return Result<std::string>(stitch_text_in(path)); });
  const StitchText kind = text ? kind_of_text(*text, path) : StitchText::description;
  nlohmann::ordered_json cells;
  if (kind == StitchText::draft) (void)read_wif(*text, path, &cells);
  if (kind == StitchText::chart) cells = read_chart_cells(*text, path).value_or(nullptr);
  if (cells.is_object() && has_ending(path, ".png")) cells["chart"] = *text;
  return cells;
}

std::string chart_of_picture(const std::string& bytes, const std::string& file) {
  const std::span data(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  const auto size = picture_size(data);
  const auto refuse = [&](std::string why) {
    throw Failure{{Code::stitch_invalid, file, "", std::move(why)}};
  };
  if (std::max(size.x, size.y) > max_picture_side)
    refuse(fmt::format("{} x {} pixels, a chart has at most {} x {}, one for a stitch: make it smaller",
                       size.x, size.y, max_picture_side, max_picture_side));
  const Image image = value_or_throw(decode_image(data, file, Transfer::keep));
  std::map<std::uint32_t, int> counts;
  std::vector<std::uint32_t> colours;
  int clear = 0;
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    std::uint32_t colour = 0;
    for (int c = 0; c < 3; ++c)
      colour = colour << 8U | static_cast<std::uint32_t>(std::lround(255 * image.pixels[i + c]));
    ++counts[colours.emplace_back(colour)];
    clear += image.pixels[i + 3] < 1 ? 1 : 0;
  }
  if (clear > 0) refuse(fmt::format("{} pixels are not opaque: fill them with a colour", clear));
  if (counts.size() > max_picture_colours)
    refuse(fmt::format("{} colours, at most {} can be yarns: reduce it to so few, without dithering",
                       counts.size(), max_picture_colours));
  std::vector<std::pair<int, std::uint32_t>> yarns;
  for (const auto& [colour, count] : counts) yarns.emplace_back(-count, colour);
  std::ranges::sort(yarns);
  std::string chart = fmt::format("float: {}\n", usual_float_stitches);
  std::map<std::uint32_t, char> letters;
  for (const auto& [count, colour] : yarns) {
    letters[colour] = static_cast<char>('A' + letters.size());
    chart += fmt::format("yarn {}: albedo=#{:06x}\n", letters[colour], colour);
  }
  for (int y = 0; y < image.height; ++y) {
    chart += fmt::format("{}: k{} [", image.height - y, image.width);
    const auto row = colours.begin() + static_cast<std::ptrdiff_t>(y) * image.width;
    for (int x = 0, end = 0; x < image.width; x = end) {
      while (end < image.width && row[end] == row[x]) ++end;
      chart += fmt::format("{}{}{}", x > 0 ? " " : "", letters[row[x]], end - x);
    }
    chart += "]\n";
  }
  return chart;
}

}  // namespace selvedge
