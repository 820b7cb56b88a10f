#include "converter/stitch/chart_row.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdlib>
#include <limits>
#include <optional>
#include <string_view>

#include "converter/stitch/chart.h"

namespace selvedge {
namespace {

/// A stitch, or a cable of several.
struct Item {
  int makes = 1;    ///< stitches of its row
  int takes = 1;    ///< loops of the row below
  ChartStitch as;   ///< `through` counts from the first loop that it takes
  int crosses = 0;  ///< of a cable: 1: its right half lies in front, and goes to the left; -1: behind
};

/// "c4f": half of the stitches cross the other half.
std::optional<Item> cable_of(std::string_view name) {
  if (name.size() < 3 || name.front() != 'c' || (name.back() != 'f' && name.back() != 'b'))
    return std::nullopt;
  const std::string_view digits = name.substr(1, name.size() - 2);
  int width = 0;
  const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), width);
  if (read.ec != std::errc() || read.ptr != digits.data() + digits.size()) return std::nullopt;
  if (width < 2 || width > max_cable || width % 2 != 0) return std::nullopt;
  return Item{width, width, {}, name.back() == 'f' ? 1 : -1};
}

std::optional<Item> item_of(std::string_view name) {
  if (name == "k") return Item{};
  if (name == "p") return Item{1, 1, {.purl = true}};
  if (name == "yo") return Item{1, 0, {.through = {}}};
  // The one that leans over the other comes first: the left one of k2tog, the right one of ssk.
  if (name == "k2tog") return Item{1, 2, {.through = {0, 1}}};
  if (name == "ssk") return Item{1, 2, {.through = {1, 0}}};
  return cable_of(name);
}

/// A word: a name and how many of it ("k2", "A12", "k2tog").
struct Counted {
  std::string name;
  int count = 1;
  bool counted = false;  ///< the count was written
};

int count_in(std::string_view digits, int line) {
  int count = 0;
  const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), count);
  const bool sound = read.ec == std::errc() && read.ptr == digits.data() + digits.size();
  if (!sound || count < 1 || count > static_cast<int>(max_chart_stitches)) {
    throw ChartFault{line, fmt::format("\"{}\" is not a count from 1 to {}", digits, max_chart_stitches)};
  }
  return count;
}

/// The words of a part of a row; a number by itself counts the word before it. `names` are taken whole.
template <class IsName>
std::vector<Counted> counted_words(std::string_view text, int line, const IsName& is_name) {
  std::vector<Counted> words;
  while (true) {
    const std::size_t begin = text.find_first_not_of(" \t,");
    if (begin == std::string_view::npos) return words;
    text.remove_prefix(begin);
    const std::string_view word = text.substr(0, text.find_first_of(" \t,"));
    text.remove_prefix(word.size());
    if (word.find_first_not_of("0123456789") == std::string_view::npos) {
      if (words.empty() || words.back().counted)
        throw ChartFault{line, fmt::format("the count {} follows no stitch", word)};
      words.back() = {words.back().name, count_in(word, line), true};
      continue;
    }
    const std::size_t digits = is_name(word) ? word.size() : word.find_last_not_of("0123456789") + 1;
    const bool counted = digits < word.size();
    words.push_back(
        {std::string(word.substr(0, digits)), counted ? count_in(word.substr(digits), line) : 1, counted});
  }
}

std::vector<Item> items_of(const std::string& text, int line) {
  std::vector<Item> items;
  std::size_t stitches = 0;
  for (const Counted& word : counted_words(text, line, item_of)) {
    const auto item = item_of(word.name);
    if (!item) {
      throw ChartFault{
          line, fmt::format("there is no stitch \"{}\" (there are k, p, yo, k2tog, ssk, and cables of 2 to "
                            "{} stitches, c2f, c2b, c4f, c4b, ...)",
                            word.name, max_cable)};
    }
    stitches += static_cast<std::size_t>(item->makes) * static_cast<std::size_t>(word.count);
    if (stitches > max_chart_stitches) {
      throw ChartFault{line, fmt::format("more than {} stitches", max_chart_stitches)};
    }
    items.insert(items.end(), static_cast<std::size_t>(word.count), *item);
  }
  if (items.empty()) throw ChartFault{line, "the row has no stitch"};
  return items;
}

/// Columns that stitches lie away from their loops if the row's first stitch takes loop `first`, all
/// together. Of a decrease, rather the loop in front moves.
int moved_by(const std::vector<Item>& items, int first) {
  int moved = 0;
  int column = 0;
  int loop = first;
  for (const Item& item : items) {
    if (item.takes == 2 && item.makes == 1) {
      const auto distance = [&](std::size_t k) { return std::abs(loop + item.as.through[k] - column); };
      moved += 4 * (distance(0) + distance(1)) + (distance(1) > 0 ? 1 : 0);
    } else if (item.takes > 0) {
      moved += 4 * std::abs(loop - column) * item.takes;
    }
    column += item.makes;
    loop += item.takes;
  }
  return moved;
}

/// The stitches of a row, whose first one takes loop `first` of the row below.
std::vector<ChartStitch> stitches_of(const std::vector<Item>& items, int first) {
  std::vector<ChartStitch> stitches;
  int loop = first;
  for (const Item& item : items) {
    for (int k = 0; k < item.makes; ++k) {
      ChartStitch stitch = item.as;
      const int column = static_cast<int>(stitches.size());
      const int half = item.makes / 2;
      for (int& through : stitch.through) through += loop - column;
      if (item.crosses != 0) {
        const bool left = k < half;  // it takes a loop of the right half
        stitch.through = {loop + (left ? k + half : k - half) - column};
        stitch.layer = left ? item.crosses : -item.crosses;
      }
      stitches.push_back(std::move(stitch));
    }
    loop += item.takes;
  }
  return stitches;
}

/// "A A B3": a letter a stitch, or one letter for the whole row.
void give_yarns(const std::string& text, int line, ChartRow& row) {
  const auto is_letter = [](std::string_view word) {
    return word.size() == 1 && std::isalpha(static_cast<unsigned char>(word.front())) != 0;
  };
  std::size_t given = 0;
  const std::vector<Counted> words = counted_words(text, line, is_letter);
  for (const Counted& word : words) {
    if (!is_letter(word.name))
      throw ChartFault{line, fmt::format("\"{}\" is not the letter of a yarn", word.name)};
    std::size_t index = row.letters.find(word.name);
    if (index == std::string::npos) {
      index = row.letters.size();
      row.letters += word.name;
    }
    const std::size_t count =
        words.size() == 1 && !word.counted ? row.stitches.size() : static_cast<std::size_t>(word.count);
    for (std::size_t k = given; k < std::min(given + count, row.stitches.size()); ++k)
      row.stitches[k].yarn = index;
    given += count;
  }
  if (given != row.stitches.size()) {
    throw ChartFault{line,
                     fmt::format("names yarns for {} stitches, the row has {}", given, row.stitches.size())};
  }
}

}  // namespace

ChartRow row_of(const std::string& text, int line) {
  const std::size_t open = text.find('[');
  const std::size_t close = text.find(']');
  if ((open == std::string::npos) != (close == std::string::npos) ||
      (open != std::string::npos && close != text.size() - 1) || close < open) {
    throw ChartFault{line, "the letters of yarns stand in one pair of brackets at the end of the row"};
  }
  const std::vector<Item> items = items_of(text.substr(0, open), line);
  int decreases = 0;
  int overs = 0;
  for (const Item& item : items) {
    decreases += item.takes > item.makes ? 1 : 0;
    overs += item.takes < item.makes ? 1 : 0;
  }
  if (decreases != overs) {
    throw ChartFault{line,
                     fmt::format("yarn overs: {}, decreases: {}; as many of one as of the other keep the "
                                 "number of stitches",
                                 overs, decreases)};
  }
  int first = 0;
  for (int k = 1; k <= decreases; ++k) {
    for (const int other : {-k, k}) {
      if (moved_by(items, other) < moved_by(items, first)) first = other;
    }
  }
  ChartRow row{stitches_of(items, first), ""};
  if (open != std::string::npos) give_yarns(text.substr(open + 1, close - open - 1), line, row);
  return row;
}

}  // namespace selvedge
