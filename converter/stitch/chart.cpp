#include "converter/stitch/chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <sstream>

#include "converter/stitch/chart_rows.h"
#include "converter/stitch/chart_stitches.h"
#include "converter/stitch/fibres.h"
#include "converter/stitch/text_fault.h"
#include "format/base/option_text.h"
#include "format/base/printable.h"

namespace selvedge {
namespace {

/// "wale_mm" or "yarn A", and what follows the colon.
struct Line {
  int number = 0;
  std::string key;
  std::string value;
};

constexpr const char* radius_parameter = "radius_mm";
constexpr const char* albedo_parameter = "albedo";

/// The lines that are no comments.
std::vector<TextLine> lines_of(std::string_view text) {
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  std::vector<TextLine> lines;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view whole = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (whole.ends_with('\r')) whole.remove_suffix(1);
    if (whole.find('\0') != std::string_view::npos) refuse_line(number, "has a NUL byte");
    if (escape_invalid_utf8(whole) != whole) refuse_line(number, "has a byte that is not UTF-8");
    const std::string line = trimmed(whole);
    if (!line.starts_with('#')) lines.push_back({number, line});
  }
  return lines;
}

/// Whether a line of instructions is one of a chart's head; "Yarn A: cream" is not.
bool is_header(const std::string& line) {
  const std::size_t colon = line.find(':');
  const std::string key = lower_case(trimmed(line.substr(0, colon)));
  const bool is_yarn = key.starts_with("yarn ") && key.size() == std::string_view("yarn A").size();
  return colon != std::string::npos &&
         (key == "name" || key == "wale_mm" || key == "course_mm" || key == "float" ||
          (is_yarn && (line.find('=') != std::string::npos || colon + 1 == line.size())));
}

double length_in(const Line& line) {
  const auto numbers = parse_numbers(line.value, ',', 1, 1);
  if (!numbers || !(numbers->front() >= min_stitch_mm && numbers->front() <= max_stitch_mm))
    refuse_line(line.number, fmt::format("{} must be a number from {} to {}, is \"{}\"", line.key,
                                         min_stitch_mm, max_stitch_mm, line.value));
  return numbers->front();
}

/// " k2 p": each word with how often it follows itself; cables are said one by one.
std::string runs_of(const std::vector<std::string>& words) {
  std::string text;
  for (std::size_t i = 0, count = 1; i < words.size(); i += count, count = 1) {
    while (i + count < words.size() && words[i + count] == words[i] &&
           (words[i].ends_with("tog") || words[i].find_first_of("/0123456789") == std::string::npos))
      ++count;
    text += " " + words[i] + (count > 1 ? std::to_string(count) : "");
  }
  return text;
}

class ChartReader {
 public:
  explicit ChartReader(const std::string& file) : file_(file) {}

  ChartText read(std::string_view text) {
    read_lines(text, false);
    for (const ReadRow& row : rows_) {
      std::set<std::size_t> yarns;
      for (const ChartStitch& stitch : row.stitches) yarns.insert(stitch.yarn);
      if (yarns.size() > max_row_yarns)
        refuse_line(row.line, fmt::format("the row has {} yarns, at most {} can float behind it",
                                          yarns.size(), max_row_yarns));
    }
    finish();
    return std::move(chart_);
  }

  nlohmann::ordered_json cells(std::string_view text) {
    read_lines(text, true);
    std::string letters;
    auto yarns = nlohmann::ordered_json::array();
    for (std::size_t k = 0; k < names_.size(); ++k) {
      letters += static_cast<char>(has_head_yarns_ || is_chart_ ? names_[k].front() : 'A' + k);
      const V3f& albedo = chart_.knit.yarns[k].albedo;
      yarns.push_back({{"name", std::string(1, letters[k])}, {"albedo", {albedo.x, albedo.y, albedo.z}}});
    }
    auto rows = nlohmann::ordered_json::array();
    bool has_names = true;
    for (auto row = rows_.rbegin(); row != rows_.rend(); ++row) {
      std::vector<std::string> names;
      std::vector<std::string> of_yarns;
      auto stitches = nlohmann::ordered_json::array();
      for (const NamedStitch& stitch : name_stitches(row->stitches)) {
        stitches.push_back({stitch.name, stitch.columns});
        names.push_back(stitch.name);
        has_names = has_names && !stitch.name.empty();
      }
      for (const ChartStitch& stitch : row->stitches) of_yarns.emplace_back(1, letters[stitch.yarn]);
      head_ += fmt::format("{}:{}", row->number, runs_of(names));
      if (letters.size() > 1) head_ += fmt::format(" [{}]", fmt::join(of_yarns, " "));
      head_ += "\n";
      rows.push_back({{"number", row->number}, {"line", row->line}, {"stitches", stitches}});
      rows.back()["yarns"] = fmt::format("{}", fmt::join(of_yarns, ""));
    }
    nlohmann::ordered_json cells = {{"name", chart_.name}, {"yarns", yarns}, {"rows", rows}};
    if (!is_chart_) cells["chart"] = has_names ? head_ : "";
    return cells;
  }

 private:
  /// `leniently`: leaves faults in lines of a chart aside.
  void read_lines(std::string_view text, bool leniently) {
    const std::vector<TextLine> lines = lines_of(text);
    is_chart_ = is_chart(lines);
    std::vector<TextLine> rows;
    std::string letters;
    for (const TextLine& line : lines) {
      const bool head = is_chart_ ? !line.text.empty() && !begins_row(line.text) : is_header(line.text);
      has_rows_ = has_rows_ || begins_row(line.text);
      if (!head)
        rows.push_back(line);
      else if (const auto read = catch_failure([&] { add_header(line); }); !read && !(leniently && is_chart_))
        throw Failure{read.error()};
    }
    for (const std::string& name : names_) letters += name;
    const auto find = [&](const std::string& name, int line) { return find_yarn(name, line); };
    rows_ = read_rows(rows, letters, find, chart_.remarks, leniently);
    if (names_.empty()) add_yarn({1, "yarn A", ""});
  }

  void add_header(const TextLine& whole) {
    const std::size_t colon = whole.text.find(':');
    if (colon == std::string::npos || colon == 0)
      refuse_line(whole.number, "is neither of the form \"name: rope\" nor a row such as \"1: k2 p2\"");
    Line line{whole.number, trimmed(whole.text.substr(0, colon)), trimmed(whole.text.substr(colon + 1))};
    const char letter = line.key.back();
    line.key = lower_case(line.key);
    const bool yarn = line.key.starts_with("yarn ");
    if (yarn) line.key.back() = letter;
    if (has_rows_) refuse_line(line.number, fmt::format("\"{}\" must come before the rows", line.key));
    if (!keys_.insert(line.key).second)
      refuse_line(line.number, fmt::format("\"{}\" is said a second time", line.key));
    head_ += whole.text + "\n";
    if (yarn) {
      add_yarn(line);
      has_head_yarns_ = true;
    } else if (line.key == "name") {
      chart_.name = line.value;
    } else if (line.key == "wale_mm") {
      chart_.knit.wale_mm = length_in(line);
    } else if (line.key == "course_mm") {
      chart_.knit.course_mm = length_in(line);
    } else if (line.key == "float") {
      const auto count = parse_count(line.value, 1024);
      if (!count)
        refuse_line(line.number, fmt::format("float must be a count from 1 to 1024, is \"{}\"", line.value));
      chart_.knit.max_float = *count;
    } else if (line.key == "blocked" && (line.value == "yes" || line.value == "no")) {
      blocked_ = line.value == "yes";
    } else {
      refuse_line(line.number,
                  fmt::format("\"{}\" must be name, wale_mm, course_mm, blocked (yes or no), float, "
                              "\"yarn A\" or the number of a row",
                              line.key));
    }
  }

  /// The letter of a yarn, and its settings as --set has them.
  void add_yarn(const Line& line) {
    const char letter = line.key.back();
    if (line.key.size() != std::string_view("yarn A").size() ||
        std::isalpha(static_cast<unsigned char>(letter)) == 0)
      refuse_line(line.number, "a yarn is called by one letter, as \"yarn A\"");
    if (names_.size() == max_chart_yarns)
      refuse_line(line.number, fmt::format("there are more than {} yarns", max_chart_yarns));
    StitchSettings settings;
    std::stringstream words(line.value);
    for (std::string word; words >> word;) {
      const std::size_t before = settings.size();
      if (!parse_setting(word, settings))
        refuse_line(
            line.number,
            fmt::format("\"{}\" is not of the form albedo=#aa3322, radius_mm=0.6 or yarn=wool (there are {})",
                        word, yarn_kind_names()));
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
    Yarn yarn{.radius_mm = values->number(radius_parameter),
              .fibre_kind = static_cast<int>(values->number(yarn_parameter))};
    const auto& albedo = values->numbers(albedo_parameter);
    yarn.albedo = V3f(V3d(albedo[0], albedo[1], albedo[2]));
    for (const char* own : {yarn_parameter, radius_parameter, albedo_parameter}) settings.erase(own);
    names_.emplace_back(1, letter);
    yarn_lines_.push_back(line.number);
    chart_.knit.yarns.push_back(yarn);
    chart_.settings.push_back(std::move(settings));
  }

  /// In a chart, and where the head has yarns, of these; else yarns that are called get colours of their own.
  std::size_t find_yarn(const std::string& name, int line) {
    static const std::vector<std::string> colours{"#e6dcc4", "#1f3c6e", "#a3262a", "#4d6b3c"};
    if (is_chart_ && names_.empty()) add_yarn({line, "yarn A", ""});
    // MC is the first yarn of a head, CC or CC1 the second.
    const std::size_t place = name == "mc"      ? 0
                              : name == "cc"    ? 1
                              : name.size() < 3 ? names_.size()
                                                : name[2] - '0';
    if (has_head_yarns_ && name.size() > 1 && place < names_.size()) return place;
    for (const std::string& called :
         {name, name.size() > 1 ? name : std::string(1, static_cast<char>(name[0] ^ ('a' ^ 'A')))})
      if (const auto found = std::ranges::find(names_, called); found != names_.end())
        return found - names_.begin();
    if (is_chart_ || has_head_yarns_)
      refuse_line(line, fmt::format("there is no yarn {} (there are {})", name, fmt::join(names_, ", ")));
    const std::string albedo = "albedo=" + colours[names_.size() % colours.size()];
    head_ += fmt::format("yarn {}: {}\n", static_cast<char>('A' + names_.size()), albedo);
    add_yarn({line, "yarn A", albedo});
    names_.back() = name;
    return names_.size() - 1;
  }

  void finish() {
    KnitChart& knit = chart_.knit;
    cut_to_repeat();
    for (const ReadRow& row : rows_) knit.rows.push_back(row.stitches);
    check_slipped();
    const double shorter = std::min(knit.wale_mm * static_cast<double>(knit.rows.front().size()),
                                    knit.course_mm * static_cast<double>(knit.rows.size()));
    // Lace is always blocked: it closes as soon as it is free.
    const auto is_yarn_over = [](const ChartStitch& stitch) {
      return stitch.source_loops.empty() && stitch.held == ChartStitch::Held::none && stitch.twist == 0;
    };
    knit.blocked = blocked_.value_or(std::ranges::any_of(
        knit.rows, [&](const auto& row) { return std::ranges::any_of(row, is_yarn_over); }));
    for (std::size_t k = 0; k < knit.yarns.size(); ++k) {
      double& radius = knit.yarns[k].radius_mm;
      if (radius == 0) radius = default_radius(knit, knit.yarns[k].fibre_kind);
      if (radius > StitchLimits().radius_periods * shorter)
        refuse_line(yarn_lines_[k], fmt::format("radius_mm: {} is more than {} times the shorter side {} mm "
                                                "of the chart",
                                                radius, StitchLimits().radius_periods, shorter));
    }
    double crossings = 0;
    std::pair<double, int> tallest{0, 0};  // and its line
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      const double height = crossing_courses(knit, static_cast<int>(k));
      crossings += height;
      if (height > tallest.first) tallest = {height, rows_[k].line};
    }
    const double room = max_crossing_fraction * static_cast<double>(rows_.size());
    if (crossings > room)
      refuse_line(tallest.second,
                  fmt::format("stitches that move aside take {:.2f} rows of the chart, there is room for "
                              "{:.2f}: knit more rows between them",
                              crossings, room));
    for (std::size_t yarn = 0; yarn < names_.size(); ++yarn) remark_on_floats(yarn);
  }

  /// Refuses what is never knitted, and slipped loops for which the drawing has no room.
  void check_slipped() const {
    using Held = ChartStitch::Held;
    const auto stitch = [&](std::size_t row, std::size_t k) -> const ChartStitch& {
      return rows_[row % rows_.size()].stitches[k];
    };
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      bool knits = false;
      for (std::size_t k = 0; k < rows_[r].stitches.size(); ++k) {
        const ChartStitch& own = stitch(r, k);
        knits = knits || own.held == Held::none;
        if (own.held == Held::none) continue;
        if (own.source_loops != std::vector{0})
          refuse_line(rows_[r].line,
                      "a slipped stitch would move to another column: decrease next to its yarn over");
        std::size_t courses = 0;
        while (courses <= max_slipped && stitch(r + courses, k).held != Held::none) ++courses;
        if (courses > max_slipped)
          refuse_line(
              rows_[r].line,
              fmt::format("a stitch is slipped in more than {} rows: knit it between them", max_slipped));
        if (own.held != Held::tuck) continue;
        const ChartStitch& above = stitch(r + 1, k);
        const bool plain = above.held == Held::none && above.source_loops == std::vector{0};
        if (!plain)
          refuse_line(rows_[r].line, "above a tuck is one knit or purl stitch that holds both loops");
      }
      if (!knits) refuse_line(rows_[r].line, "the row knits no stitch");
    }
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
      return std::ranges::all_of(rows_,
                                 [&](const ReadRow& row) { return row.stitches[i] == row.stitches[k]; });
    });
    if (up == rows_.size() && across == width) return;
    chart_.remarks.push_back(
        fmt::format("{} x {} stitches, smallest repeat {} x {}", width, rows_.size(), across, up));
    rows_.resize(up);
    for (ReadRow& row : rows_) row.stitches.resize(across);
  }

  void remark_on_floats(std::size_t yarn) {
    int longest = 0;
    int number = 0;
    for (const ReadRow& row : rows_) {
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
    if (longest <= max_float_stitches_without_remark || chart_.knit.max_float > 0) return;
    chart_.remarks.push_back(
        fmt::format("yarn {} floats behind {} stitches of row {}: knitters catch what is longer than {}",
                    names_[yarn], longest, number, max_float_stitches_without_remark));
  }

  const std::string& file_;
  std::optional<bool> blocked_;
  ChartText chart_;
  std::string head_;                ///< its lines
  std::vector<std::string> names_;  ///< of the yarns
  bool has_head_yarns_ = false;
  bool is_chart_ = true;
  bool has_rows_ = false;
  std::vector<int> yarn_lines_;
  std::set<std::string> keys_;
  std::vector<ReadRow> rows_;
};

}  // namespace

double default_radius(const KnitChart& chart, int kind) {
  const double gauge = std::min(chart.wale_mm / KnitChart().wale_mm, chart.course_mm / KnitChart().course_mm);
  return (kind == 0 ? 0.6 : 0.71) * gauge;
}

Result<ChartText> read_chart(std::string_view text, const std::string& file) {
  if (text.size() > max_chart_bytes)
    return fail(Code::file_too_large, file, "",
                fmt::format("{} bytes, a chart has at most {}", text.size(), max_chart_bytes));
  return with_file_name(file, [&] { return ChartReader(file).read(text); });
}

Result<nlohmann::ordered_json> read_chart_cells(std::string_view text, const std::string& file) {
  return with_file_name(file, [&] { return ChartReader(file).cells(text.substr(0, max_chart_bytes)); });
}

}  // namespace selvedge
