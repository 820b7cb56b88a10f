#include "converter/stitch/text_cells.h"

#include <nlohmann/json.hpp>

#include "converter/stitch/chart.h"
#include "converter/stitch/library.h"
#include "converter/stitch/pattern_json.h"
#include "converter/stitch/picture_chart.h"
#include "converter/stitch/wif.h"
#include "format/base/atomic_file.h"
#include "format/base/foreign.h"
#include "format/base/guard.h"
#include "format/base/option_text.h"

namespace selvedge {
StitchText kind_of_text(const std::string& text, const std::string& path) {
  if (is_wif(text) || has_ending(path, ".wif")) return StitchText::draft;
  const bool is_chart = has_ending(path, ".txt") || has_ending(path, ".png");
  return is_chart ? StitchText::chart : StitchText::description;
}

std::string stitch_text_in(const std::string& path) {
  const auto text = read_file(path, std::max(max_wif_bytes, max_stitch_bytes));
  if (text && is_png(*text)) return chart_of_picture(*text, path);
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

}  // namespace selvedge
