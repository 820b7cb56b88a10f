#include "converter/stitch/chart_stitches.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <map>

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
    const auto width = count_in(name.substr(1, name.size() - 2), twists ? 4 : max_cable);
    if (!width || *width < 2 || (*width % 2 != 0 && *width != 3)) return std::nullopt;
    return cable((*width + 1) / 2, *width / 2, name.back() == 'f', twists);
  }
  const std::size_t slash = name.find('/');
  const std::size_t way = name.find_first_of("lr");
  if (slash == std::string_view::npos || way == std::string_view::npos || way < slash) return std::nullopt;
  const auto front = count_in(name.substr(0, slash), max_cable);
  const auto back = count_in(name.substr(slash + 1, way - slash - 1), max_cable);
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
Counts count(const Parts& parts, int repeats, int line) {
  Counts sum;
  for (const Part& part : parts) {
    const auto& [takes, makes, open] =
        part.group.empty() ? Counts{part.item.takes, part.item.makes, 0} : count(part.group, repeats, line);
    const std::int64_t times = part.open ? repeats : part.count;
    if (sum.takes + sum.makes + times * (takes + makes) > 4 * std::int64_t(max_chart_stitches))
      refuse_line(line, fmt::format("more than {} stitches: {}", max_chart_stitches, one_repeat));
    sum.takes += static_cast<int>(times) * takes;
    sum.makes += static_cast<int>(times) * makes;
    sum.open += open + (part.open ? 1 : 0);
  }
  return sum;
}

/// Adds the stitches of parts in the order in which they are worked, open ones `repeats` times.
void add_items(const Parts& parts, int repeats, std::vector<StitchItem>& items) {
  for (const Part& part : parts) {
    for (int k = 0; k < (part.open ? repeats : part.count); ++k) {
      if (part.group.empty())
        items.push_back(part.item);
      else
        add_items(part.group, repeats, items);
    }
  }
}

}  // namespace

void refuse_line(int line, std::string message) {
  refuse_text(fmt::format("line {}", line), std::move(message));
}

std::optional<int> count_in(std::string_view digits, int max) {
  int count = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), count);
  const bool sound = error == std::errc() && end == digits.data() + digits.size();
  return sound && count >= 1 && count <= max ? std::optional(count) : std::nullopt;
}

std::optional<StitchItem> stitch_named(std::string_view name) {
  // Loops of a decrease from the front to the back: the left one of k2tog leans over the right one, and the
  // right one of ssk over the left one. Turned right over left (1), as knitting through the back of a loop
  // turns it.
  static const std::map<std::string_view, StitchItem> all{
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
  static const std::map<std::string_view, std::string_view> others{
      {"yfwd", "yo"},      {"yrn", "yo"},    {"yon", "yo"},       {"skp", "ssk"},       {"skpo", "ssk"},
      {"k2togtbl", "ssk"}, {"m1", "m1l"},    {"p2togtbl", "ssp"}, {"k3togtbl", "sssk"}, {"s2kp", "cdd"},
      {"s2kp2", "cdd"},    {"s2kpo", "cdd"}, {"sk2po", "sk2p"},   {"sl", "slwyib"},     {"sl1k", "slwyib"},
      {"sl1p", "slwyib"},  {"lt", "1/1lc"},  {"rt", "1/1rc"}};
  if (const auto other = others.find(name); other != others.end()) name = other->second;
  const auto found = all.find(name);
  return found != all.end() ? std::optional(found->second) : cable_named(name);
}

namespace {

/// The same stitch, worked from the back, as seen from the face.
StitchItem worked_from_back(const StitchItem& item) {
  StitchItem seen = item;
  seen.as.purl = !item.as.purl && item.takes > 0;
  for (int& loop : seen.as.source_loops) loop = item.takes - 1 - loop;
  std::ranges::reverse(seen.as.source_loops);
  using Held = ChartStitch::Held;
  if (item.as.held == Held::yarn_in_front) seen.as.held = Held::yarn_behind;
  if (item.as.held == Held::yarn_behind) seen.as.held = Held::yarn_in_front;
  if (item.as.held != Held::none) seen.as.purl = false;
  if (item.front == 0) return seen;
  seen.front = item.makes - item.front;
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
    const int right = item.left ? item.makes - item.front : item.front;
    for (int k = 0; k < item.makes; ++k) {
      ChartStitch stitch = item.as;
      const int column = static_cast<int>(stitches.size());
      for (int& through : stitch.source_loops) through += loop - column;
      if (item.front != 0) {
        const bool goes_left = k < item.makes - right;
        const bool in_front = goes_left == item.left;
        stitch.source_loops = {loop + (goes_left ? k + right : k - (item.makes - right)) - column};
        stitch.cable_layer = in_front ? 1 : -1;
        stitch.purl = in_front ? item.purls_front : item.purls_back;
      }
      stitches.push_back(std::move(stitch));
    }
    loop += item.takes;
  }
  return stitches;
}

}  // namespace

void straighten(std::vector<ChartStitch>& row) {
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

void give_yarn(Part& part, std::size_t yarn) {
  part.item.as.yarn = yarn;
  for (Part& inner : part.group) give_yarn(inner, yarn);
}

void WrittenRow::check() {
  const Counts rest = count(parts, 0, line);
  const Counts once = count(parts, 1, line);
  if (rest.open > 1)
    refuse_line(line, fmt::format("row {} repeats two groups as often as they fit: state how often", number));
  takes = rest.takes;
  per_repeat = once.takes - takes;
  const bool drifts = once.makes - rest.makes != per_repeat;
  if (drifts || rest.makes != takes)
    refuse_line(line, fmt::format("row {}{} takes {} stitches and makes {}: as many yarn overs as decreases "
                                  "keep their number, and shaped pieces are not drawn",
                                  number, drifts ? ", in its repeat," : "", drifts ? per_repeat : takes,
                                  drifts ? once.makes - rest.makes : rest.makes));
  const auto open = std::ranges::find_if(parts, &Part::open);
  if (open == parts.end() || open->left < 0) return;
  if (const int behind = count({open + 1, parts.end()}, 0, line).takes; open->left != behind)
    refuse_line(line, fmt::format("row {} repeats to the last {} stitches, and takes {} behind them", number,
                                  open->left, behind));
}

std::vector<ChartStitch> WrittenRow::stitches(int width, const std::vector<ChartStitch>& below) const {
  std::vector<StitchItem> items;
  add_items(parts, per_repeat == 0 ? 0 : (width - takes) / per_repeat, items);
  const bool mirrors = side == 'r' || side == 'o';
  if (mirrors) std::ranges::reverse(items);
  for (StitchItem& item : items)
    if (side == 'w' && item.shown == 0) item = worked_from_back(item);
  std::vector<ChartStitch> row = stitches_of(items);
  std::size_t column = 0;
  for (const StitchItem& item : items) {
    if (item.shown != 0 && below.empty())
      refuse_line(line, fmt::format("row {} shows what no row below it has", number));
    if (item.shown != 0)
      row[column].purl = (below[column].purl && !below[column].source_loops.empty()) == (item.shown > 0);
    column += static_cast<std::size_t>(item.makes);
  }
  if (yarns.size() > 1 && yarns.size() != row.size())
    refuse_line(line, fmt::format("names yarns for {} stitches, the row has {}", yarns.size(), row.size()));
  for (std::size_t k = 0; k < row.size() && !yarns.empty(); ++k)
    row[mirrors ? row.size() - 1 - k : k].yarn = yarns[std::min(k, yarns.size() - 1)];
  return row;
}

}  // namespace selvedge
