#include "converter/stitch/chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdlib>
#include <optional>
#include <set>
#include <sstream>

#include "converter/stitch/fibres.h"
#include "converter/stitch/text_fault.h"
#include "format/base/option_text.h"
#include "format/base/printable.h"

namespace selvedge {
namespace {

[[noreturn]] void refuse_line(int line, std::string message) {
  refuse_text(fmt::format("line {}", line), std::move(message));
}

struct ChartRow {
  std::vector<ChartStitch> stitches;  ///< whose `yarn` is an index into `letters`
  std::string letters;                ///< of the yarns that the row names; empty: it names no yarn
};

/// A stitch, or a cable of several.
struct Item {
  int makes = 1;    ///< stitches of its row
  int takes = 1;    ///< loops of the row below
  ChartStitch as;   ///< `through` counts from the first loop that it takes
  int crosses = 0;  ///< of a cable: 1: its right half lies in front, and goes to the left; -1: behind
};

/// A number from 1 to `max` in digits alone.
std::optional<int> count_in(std::string_view digits, int max) {
  int count = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), count);
  const bool sound = error == std::errc() && end == digits.data() + digits.size();
  return sound && count >= 1 && count <= max ? std::optional(count) : std::nullopt;
}

/// "c4f": half of the stitches cross the other half.
std::optional<Item> cable_of(std::string_view name) {
  if (name.size() < 3 || name.front() != 'c' || (name.back() != 'f' && name.back() != 'b'))
    return std::nullopt;
  const auto width = count_in(name.substr(1, name.size() - 2), max_cable);
  if (!width || *width % 2 != 0) return std::nullopt;
  return Item{*width, *width, {}, name.back() == 'f' ? 1 : -1};
}

std::optional<Item> item_of(std::string_view name) {
  if (name == "k") return Item{};
  if (name == "p") return Item{1, 1, {.purl = true}};
  if (name == "yo") return Item{1, 0, {.source_loops = {}}};
  // The one that leans over the other comes first: the left one of k2tog, the right one of ssk.
  if (name == "k2tog") return Item{1, 2, {.source_loops = {0, 1}}};
  if (name == "ssk") return Item{1, 2, {.source_loops = {1, 0}}};
  return cable_of(name);
}

/// A word: a name and how many of it ("k2", "A12", "k2tog").
struct Counted {
  std::string name;
  int count = 1;
  bool counted = false;  ///< the count was written
};

/// The words of a part of a row; a number by itself counts the word before it. `names` are taken whole.
template <class IsName>
std::vector<Counted> counted_words(std::string_view text, int line, const IsName& is_name) {
  const auto count_of = [&](std::string_view digits) {
    const auto count = count_in(digits, max_chart_stitches);
    if (!count)
      refuse_line(line, fmt::format("\"{}\" is not a count from 1 to {}", digits, max_chart_stitches));
    return *count;
  };
  std::vector<Counted> words;
  while (true) {
    const std::size_t begin = text.find_first_not_of(" \t,");
    if (begin == std::string_view::npos) return words;
    text.remove_prefix(begin);
    const std::string_view word = text.substr(0, text.find_first_of(" \t,"));
    text.remove_prefix(word.size());
    if (word.find_first_not_of("0123456789") == std::string_view::npos) {
      if (words.empty() || words.back().counted)
        refuse_line(line, fmt::format("the count {} follows no stitch", word));
      words.back() = {words.back().name, count_of(word), true};
      continue;
    }
    const std::size_t digits = is_name(word) ? word.size() : word.find_last_not_of("0123456789") + 1;
    const bool counted = digits < word.size();
    words.push_back(
        {std::string(word.substr(0, digits)), counted ? count_of(word.substr(digits)) : 1, counted});
  }
}

std::vector<Item> items_of(const std::string& text, int line) {
  std::vector<Item> items;
  std::size_t stitches = 0;
  for (const Counted& word : counted_words(lower_case(text), line, item_of)) {
    const auto item = item_of(word.name);
    if (!item) {
      refuse_line(line,
                  fmt::format("there is no stitch \"{}\" (there are k, p, yo, k2tog, ssk, and cables of 2 to "
                              "{} stitches, c2f, c2b, c4f, c4b, ...)",
                              word.name, max_cable));
    }
    stitches += static_cast<std::size_t>(item->makes) * static_cast<std::size_t>(word.count);
    if (stitches > max_chart_stitches)
      refuse_line(line, fmt::format("more than {} stitches", max_chart_stitches));
    items.insert(items.end(), static_cast<std::size_t>(word.count), *item);
  }
  if (items.empty()) refuse_line(line, "the row has no stitch");
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
      const auto distance = [&](std::size_t k) { return std::abs(loop + item.as.source_loops[k] - column); };
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
      for (int& through : stitch.source_loops) through += loop - column;
      if (item.crosses != 0) {
        const bool left = k < half;  // it takes a loop of the right half
        stitch.source_loops = {loop + (left ? k + half : k - half) - column};
        stitch.cable_layer = left ? item.crosses : -item.crosses;
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
      refuse_line(line, fmt::format("\"{}\" is not the letter of a yarn", word.name));
    const std::size_t index = std::min(row.letters.find(word.name), row.letters.size());
    if (index == row.letters.size()) row.letters += word.name;
    const std::size_t count =
        words.size() == 1 && !word.counted ? row.stitches.size() : static_cast<std::size_t>(word.count);
    for (std::size_t k = given; k < std::min(given + count, row.stitches.size()); ++k)
      row.stitches[k].yarn = index;
    given += count;
  }
  if (given != row.stitches.size())
    refuse_line(line, fmt::format("names yarns for {} stitches, the row has {}", given, row.stitches.size()));
}

/// "k2 p2 c4f [A4 B4]". `side`: 'r' for "(RS)": the row is written from the right; 'w' for "(WS)": as it is
/// seen from the back. Refuses unknown stitches, counts out of range, yarn overs that are not as many as
/// decreases, and yarns for fewer or more stitches than the row has.
ChartRow row_of(const std::string& text, int line, char side) {
  const std::size_t open = text.find('[');
  const std::size_t close = text.find(']');
  if ((open == std::string::npos) != (close == std::string::npos) ||
      (open != std::string::npos && close != text.size() - 1) || close < open)
    refuse_line(line, "the letters of yarns stand in one pair of brackets at the end of the row");
  std::vector<Item> items = items_of(text.substr(0, open), line);
  if (side == 'r') std::ranges::reverse(items);
  int decreases = 0;
  int overs = 0;
  for (Item& item : items) {
    if (side == 'w' && (item.takes > 1 || item.crosses != 0))
      refuse_line(line,
                  "decreases and cables are read as seen from the face: write the row so, without (WS)");
    if (side == 'w') item.as.purl = !item.as.purl && item.takes > 0;
    decreases += item.takes > item.makes ? 1 : 0;
    overs += item.takes < item.makes ? 1 : 0;
  }
  if (decreases != overs) {
    refuse_line(line, fmt::format("yarn overs: {}, decreases: {}; as many of one as of the other keep the "
                                  "number of stitches",
                                  overs, decreases));
  }
  int first = 0;
  for (int k = 1; k <= decreases; ++k) {
    for (const int other : {-k, k}) {
      if (moved_by(items, other) < moved_by(items, first)) first = other;
    }
  }
  ChartRow row{stitches_of(items, first), ""};
  if (open != std::string::npos) give_yarns(text.substr(open + 1, close - open - 1), line, row);
  for (std::size_t k = 0, end = row.stitches.size(); side == 'r' && k < end / 2; ++k)
    std::swap(row.stitches[k].yarn, row.stitches[end - 1 - k].yarn);
  return row;
}

/// The same letter in upper or lower case.
char other_case(char letter) { return static_cast<char>(letter ^ ('a' ^ 'A')); }

constexpr const char* radius_parameter = "radius_mm";
constexpr const char* albedo_parameter = "albedo";

/// "wale_mm", "yarn A" or a row's number, and what follows the colon.
struct Line {
  int number = 0;
  std::string key;
  std::string value;
  char side = 0;  ///< of a row (row_of)
};

/// Makes "Row 3 (RS)" the number of its row and its side.
void simplify_key(Line& line) {
  std::string key = lower_case(line.key);
  if (key.starts_with("row")) key = trimmed(key.substr(3));
  const bool has_side = key.ends_with("(rs)") || key.ends_with("(ws)");
  const char side = has_side ? key[key.size() - 3] : '\0';
  if (has_side) key = trimmed(key.substr(0, key.size() - 4));
  if (key.empty() || std::isdigit(static_cast<unsigned char>(key.front())) == 0) return;
  line.key = key;
  line.side = side;
}

/// The lines that say something.
std::vector<Line> lines_of(std::string_view text) {
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  std::vector<Line> lines;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view whole = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (whole.ends_with('\r')) whole.remove_suffix(1);
    if (whole.find('\0') != std::string_view::npos) refuse_line(number, "has a NUL byte");
    if (escape_invalid_utf8(whole) != whole) refuse_line(number, "has a byte that is not UTF-8");
    const std::string line = trimmed(whole);
    if (line.empty() || line.front() == '#') continue;
    const std::size_t colon = line.find(':');
    if (colon == std::string::npos || colon == 0)
      refuse_line(number, "is neither of the form \"name: rope\" nor a row such as \"1: k2 p2\"");
    lines.push_back({number, trimmed(line.substr(0, colon)), trimmed(line.substr(colon + 1))});
  }
  return lines;
}

double length_in(const Line& line) {
  const auto numbers = parse_numbers(line.value, ',', 1, 1);
  if (!numbers || !(numbers->front() >= min_stitch_mm && numbers->front() <= max_stitch_mm)) {
    refuse_line(line.number, fmt::format("{} must be a number from {} to {}, is \"{}\"", line.key,
                                         min_stitch_mm, max_stitch_mm, line.value));
  }
  return numbers->front();
}

class ChartReader {
 public:
  explicit ChartReader(const std::string& file) : file_(file) {}

  ChartText read(std::string_view text) {
    for (Line& line : lines_of(text)) {
      simplify_key(line);
      const bool is_row = std::isdigit(static_cast<unsigned char>(line.key.front())) != 0;
      is_row ? add_row(line) : add_header(line);
    }
    if (rows_.empty()) refuse_text("", "has no row");
    finish();
    return std::move(chart_);
  }

 private:
  /// A row as the text has it.
  struct Row {
    int number = 0;
    int line = 0;
    std::vector<ChartStitch> stitches;
  };

  void add_header(Line line) {
    const char letter = line.key.back();
    line.key = lower_case(line.key);
    const bool yarn = line.key.starts_with("yarn ");
    if (yarn) line.key.back() = letter;
    if (!rows_.empty()) refuse_line(line.number, fmt::format("\"{}\" must come before the rows", line.key));
    if (!keys_.insert(line.key).second)
      refuse_line(line.number, fmt::format("\"{}\" is said a second time", line.key));
    if (yarn) {
      add_yarn(line);
    } else if (line.key == "name") {
      chart_.name = line.value;
    } else if (line.key == "wale_mm") {
      chart_.knit.wale_mm = length_in(line);
    } else if (line.key == "course_mm") {
      chart_.knit.course_mm = length_in(line);
    } else {
      refuse_line(line.number,
                  fmt::format("\"{}\" must be name, wale_mm, course_mm, \"yarn A\" or the number of a row",
                              line.key));
    }
  }

  /// The letter of a yarn, and its settings as --set has them.
  void add_yarn(const Line& line) {
    const char letter = line.key.back();
    if (line.key.size() != std::string_view("yarn A").size() ||
        std::isalpha(static_cast<unsigned char>(letter)) == 0)
      refuse_line(line.number, "a yarn is called by one letter, as \"yarn A\"");
    if (letters_.size() == max_chart_yarns)
      refuse_line(line.number, fmt::format("there are more than {} yarns", max_chart_yarns));
    StitchSettings settings;
    std::stringstream words(line.value);
    for (std::string word; words >> word;) {
      const std::size_t before = settings.size();
      if (!parse_setting(word, settings)) {
        refuse_line(
            line.number,
            fmt::format("\"{}\" is not of the form albedo=#aa3322, radius_mm=0.6 or yarn=wool (there are {})",
                        word, yarn_kind_names()));
      }
      if (settings.size() == before)
        refuse_line(line.number, fmt::format("\"{}\" sets a parameter a second time", word));
    }
    std::vector<StitchParameter> parameters = yarn_parameters("", {});
    parameters.push_back(yarn_kind_parameters("", find_yarn_kind("wool").value()).front());
    parameters.push_back({radius_parameter, {0}, min_stitch_mm, max_stitch_mm, ""});
    const auto values = StitchValues::create(file_, parameters, settings);
    if (!values) {
      std::string place = values.error().place;
      if (place.starts_with("--set ")) place.erase(0, std::string_view("--set ").size());
      refuse_line(line.number, fmt::format("{}: {}", place, values.error().message));
    }
    Yarn yarn;
    yarn.fibre_kind = static_cast<int>(values->number(yarn_parameter));
    yarn.radius_mm = values->number(radius_parameter);
    const auto& albedo = values->numbers(albedo_parameter);
    yarn.albedo = V3f(V3d(albedo[0], albedo[1], albedo[2]));
    for (const char* own : {yarn_parameter, radius_parameter, albedo_parameter}) settings.erase(own);
    letters_ += letter;
    yarn_lines_.push_back(line.number);
    chart_.knit.yarns.push_back(yarn);
    chart_.settings.push_back(std::move(settings));
  }

  void add_row(const Line& line) {
    if (letters_.empty()) add_yarn({line.number, "yarn A", ""});
    const int number = row_number(line);
    if (!rows_.empty()) {
      const int last = rows_.back().number;
      const int step = rows_.size() > 1 ? rows_[1].number - rows_[0].number : number - last;
      if (std::abs(step) != 1 || number != last + step) {
        refuse_line(line.number,
                    fmt::format("row {} follows row {}: rows are numbered up or down by one", number, last));
      }
    }
    ChartRow row = row_of(line.value, line.number, line.side);
    if (line.side != 0 && chart_.remarks.empty())
      chart_.remarks.emplace_back("rows with (RS) are read from the right, with (WS) as seen from the back");
    if (!rows_.empty() && row.stitches.size() != rows_.front().stitches.size()) {
      refuse_line(line.number,
                  fmt::format("row {} has {} stitches, row {} has {}", number, row.stitches.size(),
                              rows_.front().number, rows_.front().stitches.size()));
    }
    if ((rows_.size() + 1) * row.stitches.size() > max_chart_stitches)
      refuse_line(line.number, fmt::format("the chart has more than {} stitches", max_chart_stitches));
    if (row.letters.size() > max_row_yarns) {
      refuse_line(line.number, fmt::format("the row has {} yarns, at most {} can float behind it",
                                           row.letters.size(), max_row_yarns));
    }
    for (ChartStitch& stitch : row.stitches) {
      if (row.letters.empty()) break;  // all of the first yarn
      const char letter = row.letters[stitch.yarn];
      stitch.yarn = letters_.find(letter);
      if (stitch.yarn == std::string::npos) stitch.yarn = letters_.find(other_case(letter));
      if (stitch.yarn == std::string::npos)
        refuse_line(line.number, fmt::format("there is no yarn {} (there are {})", letter, letters_));
    }
    rows_.push_back({number, line.number, std::move(row.stitches)});
  }

  static int row_number(const Line& line) {
    const auto number = count_in(line.key, 1'000'000);
    if (!number) refuse_line(line.number, fmt::format("\"{}\" is not the number of a row", line.key));
    return *number;
  }

  void finish() {
    KnitChart& knit = chart_.knit;
    if (rows_.front().number > rows_.back().number) std::ranges::reverse(rows_);
    cut_to_repeat();
    for (const Row& row : rows_) knit.rows.push_back(row.stitches);
    const double shorter = std::min(knit.wale_mm * static_cast<double>(knit.rows.front().size()),
                                    knit.course_mm * static_cast<double>(knit.rows.size()));
    for (std::size_t k = 0; k < knit.yarns.size(); ++k) {
      double& radius = knit.yarns[k].radius_mm;
      if (radius == 0) radius = default_radius(knit, knit.yarns[k].fibre_kind);
      if (radius > StitchLimits().radius_periods * shorter) {
        refuse_line(yarn_lines_[k], fmt::format("radius_mm: {} is more than {} times the shorter side {} mm "
                                                "of the chart",
                                                radius, StitchLimits().radius_periods, shorter));
      }
    }
    double crossings = 0;
    std::pair<double, int> tallest{0, 0};  // and its line
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      const double height = crossing_courses(knit, static_cast<int>(k));
      crossings += height;
      if (height > tallest.first) tallest = {height, rows_[k].line};
    }
    const double room = max_crossing_fraction * static_cast<double>(rows_.size());
    if (crossings > room) {
      refuse_line(tallest.second,
                  fmt::format("stitches that move aside take {:.2f} rows of the chart, there is room for "
                              "{:.2f}: knit more rows between them",
                              crossings, room));
    }
    for (std::size_t yarn = 0; yarn < letters_.size(); ++yarn) remark_on_floats(yarn);
  }

  /// Cost grows with the stitches: rows and columns that only repeat others are left out.
  void cut_to_repeat() {
    const auto repeat_of = [](std::size_t count, const auto& is_same) {
      for (std::size_t n = 1;; ++n) {
        std::size_t i = n;
        while (i < count && is_same(i, i - n)) ++i;
        if (i >= count && count % n == 0) return n;
      }
    };
    const std::size_t up = repeat_of(
        rows_.size(), [&](std::size_t i, std::size_t k) { return rows_[i].stitches == rows_[k].stitches; });
    const std::size_t width = rows_.front().stitches.size();
    const std::size_t across = repeat_of(width, [&](std::size_t i, std::size_t k) {
      return std::ranges::all_of(rows_, [&](const Row& row) { return row.stitches[i] == row.stitches[k]; });
    });
    if (up == rows_.size() && across == width) return;
    chart_.remarks.push_back(
        fmt::format("{} x {} stitches, smallest repeat {} x {}", width, rows_.size(), across, up));
    rows_.resize(up);
    for (Row& row : rows_) row.stitches.resize(across);
  }

  void remark_on_floats(std::size_t yarn) {
    int longest = 0;
    int number = 0;
    for (const Row& row : rows_) {
      const std::size_t count = row.stitches.size();
      const auto own = [&](const ChartStitch& stitch) { return stitch.yarn == yarn; };
      if (std::ranges::none_of(row.stitches, own)) continue;
      int passed = 0;
      for (std::size_t k = 0; k < 2 * count; ++k) {
        passed = own(row.stitches[k % count]) ? 0 : passed + 1;
        if (passed > longest) number = row.number;
        longest = std::max(longest, passed);
      }
    }
    if (longest <= max_float_without_remark) return;
    chart_.remarks.push_back(
        fmt::format("yarn {} floats behind {} stitches of row {}: knitters catch what is longer than {}",
                    letters_[yarn], longest, number, max_float_without_remark));
  }

  const std::string& file_;
  ChartText chart_;
  std::string letters_;  ///< of the yarns
  std::vector<int> yarn_lines_;
  std::set<std::string> keys_;
  std::vector<Row> rows_;
};

}  // namespace

double default_radius(const KnitChart& chart, int kind) {
  const double gauge = std::min(chart.wale_mm / KnitChart().wale_mm, chart.course_mm / KnitChart().course_mm);
  return (kind == 0 ? 0.6 : 0.79) * gauge;
}

Result<ChartText> read_chart(std::string_view text, const std::string& file) {
  if (text.size() > max_chart_bytes) {
    return fail(Code::file_too_large, file, "",
                fmt::format("{} bytes, a chart has at most {}", text.size(), max_chart_bytes));
  }
  return reading(file, [&] { return ChartReader(file).read(text); });
}

}  // namespace selvedge
