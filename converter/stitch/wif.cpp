#include "converter/stitch/wif.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bitset>
#include <cctype>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "converter/stitch/text_fault.h"
#include "format/base/option_text.h"

namespace selvedge {
namespace {

/// Greatest number of shafts, treadles and colours, and a set of some of them.
constexpr int max_shafts = 4096;
using WifSet = std::bitset<max_shafts + 1>;

/// Longest line, bytes: room for all numbers of a set.
constexpr std::size_t max_wif_line = 1U << 16U;

std::string upper(std::string text) {
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

std::optional<double> number_in(std::string_view text) {
  if (text.starts_with('+') || text.find_first_not_of("0123456789+-.eE") != std::string_view::npos)
    return std::nullopt;
  const auto numbers = parse_numbers(std::string(text), ',', 1, 1);
  return numbers ? std::optional(numbers->front()) : std::nullopt;
}

std::optional<bool> truth_of(const std::string& text) {
  const std::string word = lower_case(text);
  if (word == "true" || word == "yes" || word == "on" || word == "1") return true;
  if (word == "false" || word == "no" || word == "off" || word == "0") return false;
  return std::nullopt;
}

/// Throws unless the text is a whole number from `min` to `max`.
int whole_in(const std::string& text, const std::string& place, int min, int max) {
  const auto value = number_in(text);
  if (!value || *value != std::floor(*value))
    refuse_text(place, fmt::format("\"{}\" is not a whole number", text));
  if (*value < min || *value > max)
    refuse_text(place, fmt::format("must lie in {} to {}, is {}", min, max, text));
  return static_cast<int>(*value);
}

/// "[section] key", for messages.
std::string place_of(const std::string& section, const std::string& key) {
  return fmt::format("[{}] {}", section, key);
}

/// The sections that are read for their numbers, which a comment may follow. All others hold text.
constexpr std::array<std::string_view, 16> sections_of_numbers{
    "CONTENTS",       "WEAVING",        "WARP",        "WEFT",         "WARP SPACING", "WEFT SPACING",
    "WARP THICKNESS", "WEFT THICKNESS", "WARP COLORS", "WEFT COLORS",  "THREADING",    "TIEUP",
    "TREADLING",      "LIFTPLAN",       "COLOR TABLE", "COLOR PALETTE"};

/// Keys in upper case and values, and the first line that is neither, as a fault.
struct WifSection {
  std::map<std::string, std::string> values;
  std::optional<Failure> fault;

  /// Whether a section of this name is meant: text of [NOTES] may have a line "[THREADING]", too.
  bool is_readable(const std::string& name) const {
    const bool has_words = name == "CONTENTS" || name == "WEAVING" || name == "WARP" || name == "WEFT" ||
                           name == "COLOR PALETTE";
    return !fault && !values.empty() && std::ranges::all_of(values, [&](const auto& entry) {
      const auto is_number = [](const std::string& text) {
        return text.find_first_not_of("0123456789+-., ") == std::string::npos;
      };
      return is_number(entry.first) != has_words && (has_words || is_number(entry.second));
    });
  }
};

/// The sections of a text, with names in upper case.
class WifSections {
 public:
  /// Accepts names in any case, lines that end in LF, CRLF or CR, a byte order mark, empty lines, comments
  /// that begin with ";" at the start of a line or behind a number, any lines in sections of text, any
  /// single-byte encoding or UTF-8. Of repeated sections the first one that can be read is used, and of
  /// repeated keys the first. [CONTENTS] is no more than a hint. Refuses lines before the first section,
  /// lines of numbers that are neither a section nor a key or too long, and texts without sections.
  /// `lines`: of sections of numbers and their entries, by their places.
  WifSections(std::string_view text, std::set<std::string>& remarks, std::map<std::string, int>& lines) {
    std::map<std::string, std::vector<WifSection>> found;
    if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
    text = text.substr(0, text.find('\x1a'));  // where a text of DOS ends
    WifSection* current = nullptr;
    std::string section;
    bool numbers = true;
    for (int number = 1; !text.empty(); ++number) {
      const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
      std::string line = trimmed(text.substr(0, end));
      const bool pair = text.substr(end).starts_with("\r\n");
      text.remove_prefix(std::min(end + (pair ? 2 : 1), text.size()));
      if (line.empty() || line.front() == ';') continue;
      const auto refuse = [&](std::string why) {
        Failure fault{{Code::stitch_invalid, "", fmt::format("line {}", number), std::move(why)}};
        if (current == nullptr) throw fault;
        if (!current->fault) current->fault = std::move(fault);
      };
      const std::size_t close = line.front() == '[' ? line.find(']') : std::string::npos;
      // Text may begin with brackets, too.
      if (close != std::string::npos &&
          (numbers || close + 1 == line.size() || trimmed(line.substr(close + 1)).front() == ';')) {
        section = upper(trimmed(line.substr(1, close - 1)));
        numbers = std::ranges::find(sections_of_numbers, section) != sections_of_numbers.end();
        current = &found[section].emplace_back();
        if (numbers) lines.emplace("[" + section + "]", number);
        continue;
      }
      if (numbers && line.size() > max_wif_line) refuse(fmt::format("has more than {} bytes", max_wif_line));
      if (numbers && line.front() == '[') refuse("a section's name has no closing bracket");
      if (current == nullptr) refuse("is before the first section: not a WIF file");
      if (current->fault) continue;
      if (const std::size_t comment = line.find(';'); numbers && comment != std::string::npos) {
        line = trimmed(line.substr(0, comment));
        remarks.insert("comments behind numbers left out");
      }
      const std::size_t equals = line.find('=');
      if (equals == std::string::npos) {
        if (numbers) refuse("is neither a section nor of the form key=value");
        if (!numbers) remarks.insert("lines of text in other sections left out");
        continue;
      }
      const std::string key = upper(trimmed(line.substr(0, equals)));
      current->values.try_emplace(key, trimmed(line.substr(equals + 1)));
      if (numbers) lines.emplace(place_of(section, key), number);
    }
    if (found.empty()) refuse_text("", "has no section: not a WIF file");
    for (auto& [name, all] : found) choose(name, all, remarks);
    for (const std::string_view name : sections_of_numbers)
      if (denied(std::string(name)))
        remarks.insert(fmt::format("[CONTENTS] denies [{}], which is there", name));
  }

  bool has(const std::string& section) const { return sections_.contains(section); }

  /// Whether the section exists and [CONTENTS] says that it does not.
  bool denied(const std::string& section) const {
    const auto listed = find("CONTENTS", section);
    return has(section) && listed && !truth_of(*listed).value_or(true);
  }

  /// The value, if it is not empty.
  std::optional<std::string> find(const std::string& section, const std::string& key) const {
    const auto at = sections_.find(section);
    if (at == sections_.end()) return std::nullopt;
    const auto value = at->second.find(key);
    if (value == at->second.end() || value->second.empty()) return std::nullopt;
    return value->second;
  }

  /// Keys and values; empty if has() is false.
  const std::map<std::string, std::string>& all(const std::string& section) const {
    static const std::map<std::string, std::string> none;
    return has(section) ? sections_.at(section) : none;
  }

  /// Throws if has() is false.
  void need(const std::string& section) const {
    if (!has(section)) refuse_text("[" + section + "]", "the section is missing");
  }

  /// 0 where it is not said.
  int count(const std::string& section, const std::string& key, int max) const {
    const auto text = find(section, key);
    return text ? whole_in(*text, place_of(section, key), 0, max) : 0;
  }

  /// The values of entries 1 to `count` of a section; `default_value` if there is no entry or parse(text,
  /// place) returns nothing.
  template <class Value, class Parse>
  std::vector<Value> values(const std::string& section, int count, const Value& default_value,
                            const Parse& parse) const {
    std::vector<Value> values(count, default_value);
    for (const auto& [key, text] : all(section)) {
      const int index = whole_in(key, place_of(section, key), 1, count);
      if (text.empty()) continue;
      if (const auto parsed = parse(text, place_of(section, key))) values[index - 1] = *parsed;
    }
    return values;
  }

  /// Entries 1 to `count` of a section, each a list of numbers from 0 (ignored) to `max`, at most max_shafts;
  /// empty if the entry is missing.
  std::vector<WifSet> sets(const std::string& section, int count, int max) const {
    std::vector<WifSet> sets(count);
    for (const auto& [key, value] : all(section)) {
      if (value.empty() || value == "0") continue;  // also behind the last one, where some programs write it
      const int index = whole_in(key, place_of(section, key), 1, count);
      for (const std::string& part : parts_of(value, ','))
        sets[index - 1].set(whole_in(part, place_of(section, key), 0, max));
      sets[index - 1].reset(0);
    }
    return sets;
  }

 private:
  /// Takes one of the sections of a name. Throws its fault.
  void choose(const std::string& name, std::vector<WifSection>& all, std::set<std::string>& remarks) {
    const bool numbers = std::ranges::find(sections_of_numbers, name) != sections_of_numbers.end();
    auto chosen =
        std::ranges::find_if(all, [&](const WifSection& section) { return section.is_readable(name); });
    if (!numbers || chosen == all.end()) chosen = all.begin();
    if (chosen->fault) throw *chosen->fault;
    if (numbers && all.size() > 1)
      remarks.insert(fmt::format("[{}] is there {} times: number {} is read", name, all.size(),
                                 chosen - all.begin() + 1));
    sections_[name] = std::move(chosen->values);
  }

  std::map<std::string, std::map<std::string, std::string>> sections_;
};

constexpr double default_spacing_mm = 1;

/// The colours of the palette, linear.
struct WifColours {
  int low = 0;
  std::array<int, 3> high{255, 255, 255};  ///< by component
  bool hsb = false;  ///< hue, saturation, brightness, each from low to high; in place of red, green, blue
  std::vector<std::optional<V3f>> table;

  /// Throws unless three parts are levels.
  V3f colour(const std::vector<std::string>& parts, const std::string& text, const std::string& place) const {
    if (parts.size() != 3) refuse_text(place, fmt::format("\"{}\" is not red, green, blue", text));
    V3d coded;
    for (int i = 0; i < 3; ++i)
      coded[i] = static_cast<double>(whole_in(parts[i], place, low, high[i]) - low) / (high[i] - low);
    if (hsb) {  // Smith 1978, "Color gamut transform pairs": red has hue 0, green 1/3, blue 2/3
      const V3d levels = coded;
      for (int i = 0; i < 3; ++i) {
        const double away = std::abs(std::remainder(levels.x - i / 3.0, 1.0));
        coded[i] = levels.z * (1 - levels.y * std::clamp(6 * away - 1, 0.0, 1.0));
      }
    }
    V3f colour;
    for (int i = 0; i < 3; ++i)
      colour[i] = static_cast<float>(coded[i] <= 0.04045 ? coded[i] / 12.92
                                                         : std::pow((coded[i] + 0.055) / 1.055, 2.4));
    return colour;
  }
};

WifColours colours_of(const WifSections& draft, std::set<std::string>& remarks) {
  WifColours colours;
  V3d highest(0, 0, 0);
  for (const auto& [key, value] : draft.all("COLOR TABLE")) {
    const auto parts = parts_of(value, ',');
    for (int i = 0; i < static_cast<int>(std::min<std::size_t>(parts.size(), 3)); ++i)
      highest[i] = std::max(highest[i], number_in(parts[i]).value_or(0));
  }
  const std::string form = lower_case(draft.find("COLOR PALETTE", "FORM").value_or("rgb"));
  colours.hsb = form == "hsb" || form == "hsv";
  if (!colours.hsb && form != "rgb")
    remarks.insert("[COLOR PALETTE] of another form: read as red, green, blue");
  const auto range = draft.find("COLOR PALETTE", "RANGE");
  const double larger = std::max(highest.y, highest.z);
  // Fiberworks counts to 999, others to 65535.
  const double all = std::max(highest.x, larger);
  int high = all <= 255 ? 255 : all <= 999 ? 999 : 65535;
  if (range) {
    const std::string place = place_of("COLOR PALETTE", "RANGE");
    const auto ends = parts_of(*range, ',');
    if (ends.size() != 2) refuse_text(place, fmt::format("\"{}\" is not of the form 0,255", *range));
    colours.low = whole_in(ends[0], place, -1000000, 1000000);
    high = whole_in(ends[1], place, -1000000, 1000000);
    if (high <= colours.low) refuse_text(place, fmt::format("\"{}\" holds no values", *range));
  }
  colours.high.fill(high);
  if (colours.hsb && colours.low == 0 && larger <= 100 && highest.x <= 360 &&
      (!range || high == 360 || highest.x > high)) {
    colours.high = {360, 100, 100};
    remarks.insert("[COLOR TABLE] of HSB: hues read in degrees, the rest in percent");
  } else if (!range && high > 255) {
    remarks.insert(fmt::format("[COLOR PALETTE] without a range: 0 to {}", high));
  }
  for (const auto& [key, value] : draft.all("COLOR TABLE")) {
    const std::string place = place_of("COLOR TABLE", key);
    const int index = whole_in(key, place, 1, max_shafts);
    const V3f colour = colours.colour(parts_of(value, ','), value, place);
    if (colours.table.size() < static_cast<std::size_t>(index)) colours.table.resize(index);
    colours.table[index - 1] = colour;
  }
  return colours;
}

/// The yarns of the warp or of the weft.
struct WifSystem {
  std::vector<Yarn> yarns;
  std::vector<double> width_mm;
};

/// Millimetres per unit of a section's lengths.
double unit_of(const WifSections& draft, const std::string& section) {
  const std::string name = lower_case(draft.find(section, "UNITS").value_or("centimeters"));
  if (name.starts_with("decipoint")) return 25.4 / 720;
  if (name.starts_with("inch") || name == "in") return 25.4;
  if (name == "mm" || name.starts_with("millimet")) return 1;
  if (name == "cm" || name.starts_with("centimet")) return 10;
  refuse_text(place_of(section, "UNITS"),
              fmt::format("\"{}\" must be Decipoints, Inches or Centimeters", name));
}

/// `section`: "WARP" or "WEFT"; `albedo`: of yarns without a colour.
WifSystem system_of(const WifSections& draft, const std::string& section, const V3f& albedo,
                    const WifColours& colours, std::set<std::string>& remarks) {
  draft.need(section);
  const auto stated = draft.find(section, "THREADS");
  if (!stated) refuse_text(place_of(section, "THREADS"), "is missing");
  const int threads = whole_in(*stated, place_of(section, "THREADS"), 1, max_wif_threads);
  const double unit = unit_of(draft, section);
  const auto length = [&](std::string text, const std::string& place) {
    if (const std::size_t comma = text.find(','); comma != std::string::npos) {
      text[comma] = '.';
      remarks.insert("commas in lengths read as decimal points");
    }
    const auto value = number_in(text);
    if (!value || *value < 0) refuse_text(place, fmt::format("\"{}\" is not a number of at least 0", text));
    if (*value == 0) return std::optional<double>();  // some programs write it for "not given"
    const double mm = *value * unit;
    if (mm < min_stitch_mm || mm > max_stitch_mm)
      refuse_text(place, fmt::format("must lie in {} to {} mm, is {}", min_stitch_mm, max_stitch_mm, mm));
    return std::optional(mm);
  };
  const auto colour = [&](const std::string& text, const std::string& place) -> std::optional<V3f> {
    // The number of a palette entry; some programs write its red, green and blue behind it.
    const auto parts = parts_of(text, ',');
    const int index = whole_in(parts.front(), place, 0, max_shafts);
    if (index == 0) return albedo;
    if (index <= static_cast<int>(colours.table.size()) && colours.table[index - 1])
      return colours.table[index - 1];
    if (parts.size() == 4) return colours.colour({parts.begin() + 1, parts.end()}, text, place);
    remarks.insert("colours that are not in [COLOR TABLE]: as yarns without a colour");
    return albedo;
  };
  const auto section_default = [&](const char* key, const auto& parse) {
    const auto text = draft.find(section, key);
    return text ? parse(*text, place_of(section, key)) : std::nullopt;
  };
  const auto spacing = section_default("SPACING", length);
  const auto thickness = section_default("THICKNESS", length);
  if (!spacing && !draft.has(section + " SPACING"))
    remarks.insert(fmt::format("{} without a spacing: {} mm", lower_case(section), default_spacing_mm));
  WifSystem system;
  system.yarns.resize(threads);
  system.width_mm = draft.values(section + " SPACING", threads, spacing.value_or(default_spacing_mm), length);
  const auto thicknesses = draft.values(section + " THICKNESS", threads, thickness, length);
  constexpr double wide_mm = 20;
  const double widest = *std::ranges::max_element(system.width_mm);
  if (widest >= wide_mm)
    remarks.insert(
        fmt::format("{} spacing of {:.4g} mm: Spacing is a length; for ends an inch or a centimetre "
                    "write 1 divided by them",
                    lower_case(section), widest));
  const auto albedos =
      draft.values(section + " COLORS", threads, section_default("COLOR", colour).value_or(albedo), colour);
  for (int k = 0; k < threads; ++k) {
    const double width = system.width_mm[k];
    system.yarns[k].name = fmt::format("{} {}", lower_case(section), k + 1);
    system.yarns[k].albedo = albedos[k];
    // Round yarns wider than their lane would lie on top of each other.
    system.yarns[k].radius_mm = 0.5 * std::min(thicknesses[k].value_or(width), width);
    if (thicknesses[k].value_or(width) > width)
      remarks.insert(fmt::format("{} thicker than its spacing: as thick as that", lower_case(section)));
  }
  return system;
}

/// The largest number in any of the sets; 0: they are empty.
int largest_in(const std::vector<WifSet>& sets) {
  WifSet all;
  for (const WifSet& set : sets) all |= set;
  int largest = max_shafts;
  while (largest > 0 && !all[largest]) --largest;
  return largest;
}

/// Number of yarns without empty ones at the end, which a canvas has that was never filled: they are
/// two or more, and more than are empty side by side before them.
int used_of(const std::vector<WifSet>& sets) {
  std::size_t longest = 1;
  std::size_t run = 0;
  for (const WifSet& set : sets) {
    if (set.any()) longest = std::max(longest, run);
    run = set.none() ? run + 1 : 0;
  }
  return static_cast<int>(run > longest && run < sets.size() ? sets.size() - run : sets.size());
}

/// The shafts that are lifted for each weft yarn, and the treadles, or else shafts, that its draft gives.
struct Lifts {
  std::vector<WifSet> shafts;
  std::vector<WifSet> given;
  std::vector<WifSet> tieup{};  ///< shafts of treadles
};

/// Tie-ups may name more shafts and treadles than the header counts.
Lifts lifts_of(const WifSections& draft, int wefts, std::set<std::string>& remarks) {
  const bool tied = !draft.all("TREADLING").empty() && !draft.all("TIEUP").empty();
  if (draft.has("LIFTPLAN") && !(tied && draft.denied("LIFTPLAN"))) {
    auto shafts = draft.sets("LIFTPLAN", wefts, max_shafts);
    if (!tied || largest_in(shafts) > 0) return {shafts, shafts};
    remarks.insert("[LIFTPLAN] lifts nothing: [TIEUP] and [TREADLING] are read");
  }
  if (!draft.has("TREADLING")) refuse_text("[TREADLING]", "the section is missing, and [LIFTPLAN] as well");
  draft.need("TIEUP");
  auto tieup = draft.sets("TIEUP", max_shafts, max_shafts);
  while (!tieup.empty() && tieup.back().none()) tieup.pop_back();
  const int treadles =
      std::max(draft.count("WEAVING", "TREADLES", max_shafts), static_cast<int>(tieup.size()));
  tieup.resize(treadles);
  Lifts lifts;
  lifts.given = draft.sets("TREADLING", wefts, treadles);
  lifts.tieup = tieup;
  for (const WifSet& treadles_of_weft : lifts.given) {
    WifSet& lifted = lifts.shafts.emplace_back();
    for (int treadle = 1; treadle <= treadles; ++treadle)
      if (treadles_of_weft[treadle]) lifted |= tieup[treadle - 1];
  }
  return lifts;
}

/// The numbers in sets.
std::vector<std::vector<int>> numbers_in(const std::vector<WifSet>& sets) {
  std::vector<std::vector<int>> numbers(sets.size());
  for (std::size_t k = 0; k < sets.size(); ++k)
    for (int number = 1; number <= max_shafts; ++number)
      if (sets[k][number]) numbers[k].push_back(number);
  return numbers;
}

/// Whether warp i is over weft j: [j * warps + i]. Leaves out empty yarns at the end and lowers the counts.
std::vector<bool> drawdown_of(const WifSections& draft, int& warps, int& wefts,
                              std::set<std::string>& remarks, nlohmann::ordered_json& cells) {
  draft.need("WEAVING");
  const int counted = draft.count("WEAVING", "SHAFTS", max_shafts);
  bool rising = true;
  if (const auto text = draft.find("WEAVING", "RISING SHED")) {
    const auto value = truth_of(*text);
    if (!value)
      refuse_text(place_of("WEAVING", "RISING SHED"), fmt::format("\"{}\" is neither true nor false", *text));
    rising = *value;
  }
  draft.need("THREADING");
  Lifts lifts = lifts_of(draft, wefts, remarks);
  const int shafts = counted > 0 ? std::max(counted, largest_in(lifts.shafts)) : max_shafts;
  auto threading = draft.sets("THREADING", warps, shafts);
  const auto over_each = [&] {
    std::vector<bool> over;
    for (const WifSet& lifted : lifts.shafts)
      for (const WifSet& shafts_of_warp : threading)
        over.push_back((shafts_of_warp & lifted).any() == rising);
    return over;
  };
  const int used_shafts = std::max({counted, largest_in(threading), largest_in(lifts.shafts)});
  cells["shafts"] = used_shafts;
  cells["treadles"] = lifts.tieup.size();
  if (std::max({warps, wefts, used_shafts, static_cast<int>(lifts.tieup.size())}) <= max_cell_side) {
    cells["threading"] = numbers_in(threading);
    cells["tieup"] = numbers_in(lifts.tieup);
    cells[lifts.tieup.empty() ? "liftplan" : "treadling"] = numbers_in(lifts.given);
    std::string drawdown;
    for (const bool is_over : over_each()) drawdown += is_over ? '#' : '-';
    cells["drawdown"] = drawdown;
  }
  const auto leave_out = [&](const char* name, int used, int& count) {
    if (used == count) return;
    remarks.insert(
        fmt::format("the last {} of {} {} yarns are not woven: left out", count - used, count, name));
    count = used;
  };
  leave_out("warp", used_of(threading), warps);
  leave_out("weft", used_of(lifts.given), wefts);
  threading.resize(warps);
  lifts.shafts.resize(wefts);
  std::vector<bool> over = over_each();
  if (std::ranges::count(over, over.front()) == std::ssize(over))
    refuse_text("", "every warp yarn stays on one side of all weft yarns: they are not woven");
  return over;
}

Weave smallest_repeat(const WifSystem& warp, const WifSystem& weft, const std::vector<bool>& over) {
  const std::size_t warps = warp.yarns.size();
  const std::size_t wefts = weft.yarns.size();
  // Yarn k meets the others at k * next + c * step.
  const auto repeat_of = [&](const WifSystem& system, std::size_t crossings, std::size_t step,
                             std::size_t next) {
    std::map<std::string, std::size_t> known;  // numbers of equal yarns
    std::vector<std::size_t> kinds;
    for (std::size_t k = 0; k < system.yarns.size(); ++k) {
      const Yarn& yarn = system.yarns[k];
      std::string text = fmt::format("{} {} {} {} {} ", yarn.albedo.x, yarn.albedo.y, yarn.albedo.z,
                                     yarn.radius_mm, system.width_mm[k]);
      for (std::size_t c = 0; c < crossings; ++c) text += over[k * next + c * step] ? '#' : '-';
      kinds.push_back(known.try_emplace(std::move(text), known.size()).first->second);
    }
    // The shortest prefix that the others repeat, at least twice.
    for (std::size_t period = 1; 2 * period <= kinds.size(); ++period)
      if (std::equal(kinds.begin() + static_cast<long>(period), kinds.end(), kinds.begin())) return period;
    return kinds.size();
  };
  const std::size_t across = repeat_of(warp, wefts, warps, 1);
  const std::size_t up = repeat_of(weft, warps, 1, warps);
  return corner_of({warp.yarns, weft.yarns, warp.width_mm, weft.width_mm, over}, across, up);
}

WifDraft draft_of(std::string_view text, nlohmann::ordered_json& cells) {
  std::set<std::string> remarks;
  std::map<std::string, int> lines;
  const WifSections draft(text, remarks, lines);
  cells["lines"] = lines;
  if (!draft.has("WIF")) refuse_text("[WIF]", "the section is missing: not a WIF file");
  const WifColours colours = colours_of(draft, remarks);
  if (colours.table.empty()) remarks.insert("no [COLOR TABLE]: off-white warp and blue weft");
  WifSystem warp = system_of(draft, "WARP", {0.62F, 0.58F, 0.50F}, colours, remarks);
  WifSystem weft = system_of(draft, "WEFT", {0.09F, 0.17F, 0.38F}, colours, remarks);
  cells["ends"] = warp.yarns.size();
  cells["picks"] = weft.yarns.size();
  if (warp.yarns.size() * weft.yarns.size() > max_wif_drawdown)
    refuse_text("[WEFT] Threads", fmt::format("{} x {} yarns are more than {} crossings", warp.yarns.size(),
                                              weft.yarns.size(), max_wif_drawdown));
  WifDraft result;
  result.title = draft.find("TEXT", "TITLE").value_or("");
  result.warp_threads = static_cast<int>(warp.yarns.size());
  result.weft_threads = static_cast<int>(weft.yarns.size());
  const auto over = drawdown_of(draft, result.warp_threads, result.weft_threads, remarks, cells);
  for (const auto& [system, count] :
       {std::pair(&warp, result.warp_threads), std::pair(&weft, result.weft_threads)}) {
    system->yarns.resize(count);
    system->width_mm.resize(count);
  }
  result.weave = smallest_repeat(warp, weft, over);
  const std::size_t across = result.weave.warp.size();
  const std::size_t up = result.weave.weft.size();
  result.remarks.push_back(fmt::format(
      "{} x {} yarns, smallest repeat {} x {}{}", result.warp_threads, result.weft_threads, across, up,
      warp.yarns.size() % across + weft.yarns.size() % up > 0 ? ", the incomplete repeat at the end left out"
                                                              : ""));
  result.remarks.insert(result.remarks.end(), remarks.begin(), remarks.end());
  return result;
}

}  // namespace

bool is_wif(std::string_view text) {
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  while (!text.empty()) {
    const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
    const std::string line = upper(trimmed(text.substr(0, end)));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (!line.empty() && line.front() != ';') return line.starts_with("[WIF]");
  }
  return false;
}

Result<WifDraft> read_wif(std::string_view text, const std::string& file, nlohmann::ordered_json* cells) {
  if (text.size() > max_wif_bytes)
    return fail(Code::file_too_large, file, "",
                fmt::format("{} bytes, a weaving draft has at most {}", text.size(), max_wif_bytes));
  nlohmann::ordered_json own;
  return with_file_name(file, [&] { return draft_of(text, cells != nullptr ? *cells : own); });
}

}  // namespace selvedge
