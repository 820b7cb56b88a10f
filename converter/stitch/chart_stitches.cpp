#include "converter/stitch/chart_stitches.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <span>

#include "converter/stitch/chart.h"

namespace selvedge {
namespace {

StitchItem cable(int front, int back, bool left, bool purls_back) {
  StitchItem item{front + back, front + back, {}, front, left};
  item.purls_back = purls_back;
  return item;
}

/// "c4f" and "t4f", of equal halves, and "t3f", which purls one; "2/1lpc": two in front of one, which is
/// purled.
std::optional<StitchItem> cable_named(std::string_view name) {
  if (name.size() < 3) return std::nullopt;
  const bool twists = name.front() == 't';
  if ((name.front() == 'c' || twists) && (name.back() == 'f' || name.back() == 'b')) {
    const auto width = parse_count(name.substr(1, name.size() - 2), twists ? 4 : max_cable);
    if (!width || *width < 2 || (*width % 2 != 0 && *width != 3)) return std::nullopt;
    return cable((*width + 1) / 2, *width / 2, name.back() == 'f', twists);
  }
  const std::size_t slash = name.find('/');
  const std::size_t way = name.find_first_of("lr");
  if (slash == std::string_view::npos || way == std::string_view::npos || way < slash) return std::nullopt;
  const auto front = parse_count(name.substr(0, slash), max_cable);
  const auto back = parse_count(name.substr(slash + 1, way - slash - 1), max_cable);
  const std::string_view kind = name.substr(way + 1);
  if (!front || !back || *front + *back > max_cable || (kind != "c" && kind != "pc")) return std::nullopt;
  return cable(*front, *back, name[way] == 'l', kind == "pc");
}

/// Columns that the stitches lie away from their loops, all together. Of a decrease, rather the loop in front
/// moves.
int moved_by(const std::vector<ChartStitch>& row, int shift) {
  int moved = 0;
  for (const ChartStitch& stitch : row) {
    for (std::size_t k = 0; k < stitch.source_loops.size(); ++k) {
      const int distance = std::abs(stitch.source_loops[k] + shift);
      moved += 4 * distance + (k > 0 && distance > 0 ? 1 : 0);
    }
  }
  return moved;
}

/// Loops of the row below that parts take, and stitches that they make.
struct Counts {
  int takes = 0;
  int makes = 0;
  int open = 0;  ///< parts that are open
};

/// Counts parts, open ones `repeats` times.
Counts count(const RowParts& parts, int repeats, int line) {
  Counts sum;
  for (const RowPart& part : parts) {
    const auto& [takes, makes, open] = part.group.empty()
                                           ? Counts{part.item.taken_loops, part.item.made_stitches, 0}
                                           : count(part.group, repeats, line);
    const std::int64_t times = part.fills_row ? repeats : part.count;
    if (sum.takes + sum.makes + times * (takes + makes) > 4 * std::int64_t(max_chart_stitches))
      refuse_line(line, fmt::format("more than {} stitches: {}", max_chart_stitches, cut_to_repeat_advice));
    sum.takes += static_cast<int>(times) * takes;
    sum.makes += static_cast<int>(times) * makes;
    sum.open += open + (part.fills_row ? 1 : 0);
  }
  return sum;
}

/// Adds the stitches of parts in the order in which they are worked, open ones `repeats` times.
void add_items(const RowParts& parts, int repeats, std::vector<StitchItem>& items) {
  for (const RowPart& part : parts) {
    for (int k = 0; k < (part.fills_row ? repeats : part.count); ++k)
      if (part.group.empty())
        items.push_back(part.item);
      else
        add_items(part.group, repeats, items);
  }
}

/// Stitches of one column by their names.
const std::map<std::string_view, StitchItem>& plain_items() {
  // Loops of a decrease from the front to the back: the left one of k2tog leans over the right one, and the
  // right one of ssk over the left one. Turned right over left (1), as knitting through the back of a loop
  // turns it.
  static const std::map<std::string_view, StitchItem> items{
      {"k", {}},
      {"p", {1, 1, {.purl = true}}},
      {"ktbl", {1, 1, {.twist = 1}}},
      {"ptbl", {1, 1, {.purl = true, .twist = 1}}},
      {"yo", {1, 0, {.source_loops = {}}}},
      {"m1l", {1, 0, {.source_loops = {}, .twist = 1}}},
      {"m1r", {1, 0, {.source_loops = {}, .twist = -1}}},
      {"k2tog", {1, 2, {.source_loops = {0, 1}}}},
      {"ssk", {1, 2, {.source_loops = {1, 0}}}},
      {"p2tog", {1, 2, {.purl = true, .source_loops = {0, 1}}}},
      {"ssp", {1, 2, {.purl = true, .source_loops = {1, 0}}}},
      {"k3tog", {1, 3, {.source_loops = {0, 1, 2}}}},
      {"sssk", {1, 3, {.source_loops = {2, 1, 0}}}},
      {"cdd", {1, 3, {.source_loops = {1, 2, 0}}}},
      {"sk2p", {1, 3, {.source_loops = {2, 0, 1}}}},
      {"p3tog", {1, 3, {.purl = true, .source_loops = {0, 1, 2}}}},
      {"slwyif", {1, 1, {.held = ChartStitch::Held::yarn_in_front}}},
      {"slwyib", {1, 1, {.held = ChartStitch::Held::yarn_behind}}},
      {"tuck", {1, 1, {.held = ChartStitch::Held::tuck}}}};
  return items;
}

/// The name of a cable; empty: its front is purled.
std::string cable_name(std::span<const ChartStitch> cable) {
  const auto count = [&](int layer, bool purl) {
    return std::ranges::count_if(cable, [&](const ChartStitch& stitch) {
      return stitch.cable_layer == layer && (!purl || stitch.purl);
    });
  };
  const auto front = count(1, false);
  const auto back = count(-1, false);
  const bool is_left = cable.front().cable_layer > 0;
  const bool purls = count(-1, true) > 0;
  if (count(1, true) > 0) return "";
  const bool is_halved = (cable.size() % 2 == 0 || cable.size() == 3) && front - back <= 1 && front >= back;
  if (is_halved && (!purls || cable.size() <= 4))
    return fmt::format("{}{}{}", purls ? 't' : 'c', cable.size(), is_left ? 'f' : 'b');
  return fmt::format("{}/{}{}{}c", front, back, is_left ? 'l' : 'r', purls ? "p" : "");
}

/// The same stitch, worked from the back, as seen from the face.
StitchItem worked_from_back(const StitchItem& item) {
  StitchItem seen = item;
  seen.chart_stitch.purl = !item.chart_stitch.purl && item.taken_loops > 0;
  for (int& loop : seen.chart_stitch.source_loops) loop = item.taken_loops - 1 - loop;
  std::ranges::reverse(seen.chart_stitch.source_loops);
  using Held = ChartStitch::Held;
  if (item.chart_stitch.held == Held::yarn_in_front) seen.chart_stitch.held = Held::yarn_behind;
  if (item.chart_stitch.held == Held::yarn_behind) seen.chart_stitch.held = Held::yarn_in_front;
  if (item.chart_stitch.held != Held::none) seen.chart_stitch.purl = false;
  if (item.front_stitches == 0) return seen;
  seen.front_stitches = item.made_stitches - item.front_stitches;
  seen.purls_front = !item.purls_back;
  seen.purls_back = !item.purls_front;
  return seen;
}

/// The stitches of a row from left to right, whose first one takes the first loop of the row below.
std::vector<ChartStitch> stitches_of(const std::vector<StitchItem>& items) {
  std::vector<ChartStitch> stitches;
  int loop = 0;
  for (const StitchItem& item : items) {
    // Stitches of a cable that go to the left come first.
    const int right = item.front_goes_left ? item.made_stitches - item.front_stitches : item.front_stitches;
    for (int k = 0; k < item.made_stitches; ++k) {
      ChartStitch stitch = item.chart_stitch;
      const int column = static_cast<int>(stitches.size());
      for (int& through : stitch.source_loops) through += loop - column;
      if (item.front_stitches != 0) {
        const bool goes_left = k < item.made_stitches - right;
        const bool in_front = goes_left == item.front_goes_left;
        stitch.source_loops = {loop + (goes_left ? k + right : k - (item.made_stitches - right)) - column};
        stitch.cable_layer = in_front ? 1 : -1;
        stitch.purl = in_front ? item.purls_front : item.purls_back;
      }
      stitches.push_back(std::move(stitch));
    }
    loop += item.taken_loops;
  }
  return stitches;
}

}  // namespace

void refuse_line(int line, std::string message) {
  refuse_text(fmt::format("line {}", line), std::move(message));
}

std::optional<int> parse_count(std::string_view digits, int max) {
  int count = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), count);
  const bool sound = error == std::errc() && end == digits.data() + digits.size();
  return sound && count >= 1 && count <= max ? std::optional(count) : std::nullopt;
}

std::optional<StitchItem> find_stitch_item(std::string_view name) {
  static const std::map<std::string_view, std::string_view> others{
      {"yfwd", "yo"},      {"yrn", "yo"},    {"yon", "yo"},       {"skp", "ssk"},       {"skpo", "ssk"},
      {"k2togtbl", "ssk"}, {"m1", "m1l"},    {"p2togtbl", "ssp"}, {"k3togtbl", "sssk"}, {"s2kp", "cdd"},
      {"s2kp2", "cdd"},    {"s2kpo", "cdd"}, {"sk2po", "sk2p"},   {"sl", "slwyib"},     {"sl1k", "slwyib"},
      {"sl1p", "slwyib"},  {"lt", "1/1lc"},  {"rt", "1/1rc"}};
  if (const auto other = others.find(name); other != others.end()) name = other->second;
  const auto found = plain_items().find(name);
  return found != plain_items().end() ? std::optional(found->second) : cable_named(name);
}

std::vector<NamedStitch> name_stitches(const std::vector<ChartStitch>& row) {
  std::vector<NamedStitch> names;
  const auto highest_loop = [&](std::size_t k) { return static_cast<int>(k) + row[k].source_loops.front(); };
  int next = static_cast<int>(row.size());  // loop of the row below, from the lowest on
  for (std::size_t k = 0; k < row.size(); ++k)
    for (const int loop : row[k].source_loops) next = std::min(next, static_cast<int>(k) + loop);
  for (std::size_t k = 0; k < row.size(); k += static_cast<std::size_t>(names.back().columns)) {
    if (row[k].cable_layer != 0) {
      // It ends where its stitches have taken as many loops as they passed.
      std::size_t end = k + 1;
      for (int highest = highest_loop(k); end < row.size() && highest - next >= static_cast<int>(end - k);
           ++end)
        highest = std::max(highest, highest_loop(end));
      const auto columns = static_cast<int>(end - k);
      names.push_back({cable_name(std::span(row).subspan(k, end - k)), columns});
      next += columns;
      continue;
    }
    ChartStitch stitch = row[k];
    stitch.yarn = 0;
    next += static_cast<int>(stitch.source_loops.size());
    if (!stitch.source_loops.empty()) {
      const int lowest = *std::ranges::min_element(stitch.source_loops);
      for (int& loop : stitch.source_loops) loop -= lowest;
    }
    const auto found = std::ranges::find_if(
        plain_items(), [&](const auto& item) { return item.second.chart_stitch == stitch; });
    names.push_back({found == plain_items().end() ? "" : std::string(found->first)});
  }
  return names;
}

void minimise_column_shifts(std::vector<ChartStitch>& row) {
  int decreases = 0;
  for (const ChartStitch& stitch : row)
    decreases += std::max(static_cast<int>(stitch.source_loops.size()) - 1, 0);
  int best = 0;
  for (int k = 1; k <= std::min(decreases, 64); ++k)
    for (const int shift : {-k, k})
      if (moved_by(row, shift) < moved_by(row, best)) best = shift;
  for (ChartStitch& stitch : row)
    for (int& loop : stitch.source_loops) loop += best;
}

void set_part_yarn(RowPart& part, std::size_t yarn) {
  part.item.chart_stitch.yarn = yarn;
  for (RowPart& inner : part.group) set_part_yarn(inner, yarn);
}

void WrittenRow::count_stitches() {
  const Counts rest = count(parts, 0, line);
  const Counts once = count(parts, 1, line);
  if (rest.open > 1)
    refuse_line(line, fmt::format("row {} repeats two groups as often as they fit: state how often", number));
  fixed_loops = rest.takes;
  loops_per_repeat = once.takes - fixed_loops;
  const bool drifts = once.makes - rest.makes != loops_per_repeat;
  if (drifts || rest.makes != fixed_loops)
    refuse_line(line,
                fmt::format("row {}{} takes {} stitches and makes {}: as many yarn overs as decreases "
                            "keep their number, and shaped pieces are not drawn",
                            number, drifts ? ", in its repeat," : "", drifts ? loops_per_repeat : fixed_loops,
                            drifts ? once.makes - rest.makes : rest.makes));
  const auto open = std::ranges::find_if(parts, &RowPart::fills_row);
  if (open == parts.end() || open->stitches_left < 0) return;
  if (const int behind = count({open + 1, parts.end()}, 0, line).takes; open->stitches_left != behind)
    refuse_line(line, fmt::format("row {} repeats to the last {} stitches, and takes {} behind them", number,
                                  open->stitches_left, behind));
}

std::vector<ChartStitch> WrittenRow::stitches(int width, const std::vector<ChartStitch>& below) const {
  std::vector<StitchItem> items;
  add_items(parts, loops_per_repeat == 0 ? 0 : (width - fixed_loops) / loops_per_repeat, items);
  const bool mirrors = side == 'r' || side == 'o';
  if (mirrors) std::ranges::reverse(items);
  for (StitchItem& item : items)
    if (side == 'w' && item.like_below == 0) item = worked_from_back(item);
  std::vector<ChartStitch> row = stitches_of(items);
  std::size_t column = 0;
  for (const StitchItem& item : items) {
    if (item.like_below != 0 && below.empty())
      refuse_line(line, fmt::format("row {} shows what no row below it has", number));
    if (item.like_below != 0)
      row[column].purl = (below[column].purl && !below[column].source_loops.empty()) == (item.like_below > 0);
    column += static_cast<std::size_t>(item.made_stitches);
  }
  if (yarns.size() > 1 && yarns.size() != row.size())
    refuse_line(line, fmt::format("names yarns for {} stitches, the row has {}", yarns.size(), row.size()));
  for (std::size_t k = 0; k < row.size() && !yarns.empty(); ++k)
    row[mirrors ? row.size() - 1 - k : k].yarn = yarns[std::min(k, yarns.size() - 1)];
  return row;
}

}  // namespace selvedge
