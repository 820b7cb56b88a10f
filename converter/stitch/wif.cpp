#include "converter/stitch/wif.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "converter/stitch/wif_sections.h"

namespace selvedge {
namespace {

constexpr int max_shafts = 4096;  // treadles and colours as well
constexpr double texels_per_yarn = 4;
constexpr double default_spacing_mm = 1;

/// A section, key or value that is not what a draft needs; never leaves this file.
struct Fault {
  std::string place;
  std::string message;
};

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::optional<double> number_in(std::string_view text) {
  double value = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc() || result.ptr != text.data() + text.size()) return std::nullopt;
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

/// "1, 2,3" -> its parts without blanks; nothing between two commas is an empty part.
std::vector<std::string> parts_of(const std::string& text) {
  std::vector<std::string> parts;
  std::string part;
  for (const char c : text + ",") {
    if (c == ',') {
      parts.push_back(part);
      part.clear();
    } else if (c != ' ' && c != '\t') {
      part += c;
    }
  }
  return parts;
}

/// The sections of a file, asked for by name.
class Draft {
 public:
  explicit Draft(const WifSections& sections) : sections_(sections) {}

  /// The table of contents may say that a section does not count.
  bool has(const std::string& section) const {
    return sections_.contains(section) && said(section).value_or(true);
  }
  /// What [CONTENTS] says of a section, if anything.
  std::optional<bool> said(const std::string& section) const {
    const auto text = find("CONTENTS", section);
    return text ? truth(*text) : std::nullopt;
  }
  std::optional<std::string> find(const std::string& section, const std::string& key) const {
    const auto at = sections_.find(section);
    if (at == sections_.end()) return std::nullopt;
    const auto value = at->second.find(key);
    if (value == at->second.end() || value->second.empty()) return std::nullopt;
    return value->second;
  }
  const std::map<std::string, std::string>& all(const std::string& section) const {
    static const std::map<std::string, std::string> none;
    const auto at = sections_.find(section);
    return at == sections_.end() || !has(section) ? none : at->second;
  }
  void need(const std::string& section) const {
    if (!sections_.contains(section)) throw Fault{"[" + section + "]", "the section is missing"};
    if (!has(section)) throw Fault{"[" + section + "]", "is needed, but [CONTENTS] says that there is none"};
  }

  static std::string place(const std::string& section, const std::string& key) {
    return fmt::format("[{}] {}", section, key);
  }
  static std::optional<bool> truth(const std::string& text) {
    const std::string word = lower(text);
    if (word == "true" || word == "yes" || word == "on" || word == "1") return true;
    if (word == "false" || word == "no" || word == "off" || word == "0") return false;
    return std::nullopt;
  }

  int whole(const std::string& section, const std::string& key, int least, int most) const {
    const auto text = find(section, key);
    if (!text) throw Fault{place(section, key), "is missing"};
    return whole_in(*text, place(section, key), least, most);
  }
  static int whole_in(const std::string& text, const std::string& place, int least, int most) {
    const auto value = number_in(text);
    if (!value || *value != std::floor(*value)) {
      throw Fault{place, fmt::format("\"{}\" is not a whole number", text)};
    }
    if (*value < least || *value > most) {
      throw Fault{place, fmt::format("must lie in {} to {}, is {}", least, most, text)};
    }
    return static_cast<int>(*value);
  }
  std::optional<double> positive(const std::string& section, const std::string& key) const {
    const auto text = find(section, key);
    if (!text) return std::nullopt;
    const auto value = number_in(*text);
    if (!value || *value < 0) {
      throw Fault{place(section, key), fmt::format("\"{}\" is not a number of at least 0", *text)};
    }
    return *value > 0 ? value : std::nullopt;  // some programs write 0 for "not said"
  }

  /// Entries 1 to `count` of a section, each a list of numbers from 0 (which says "none" and is left out) to
  /// `most`; empty where the entry is missing.
  std::vector<std::vector<int>> lists(const std::string& section, int count, int most) const {
    std::vector<std::vector<int>> lists(static_cast<std::size_t>(count));
    for (const auto& [key, value] : all(section)) {
      if (value.empty() || value == "0") continue;  // also behind the last one, where some programs write it
      const int index = whole_in(key, place(section, key), 1, count);
      for (const std::string& part : parts_of(value)) {
        const int number = whole_in(part, place(section, key), 0, most);
        if (number > 0) lists[index - 1].push_back(number);
      }
    }
    return lists;
  }

 private:
  const WifSections& sections_;
};

/// The colours of the palette, linear.
std::vector<V3f> palette_of(const Draft& draft) {
  std::vector<V3f> colours;
  if (!draft.has("COLOR TABLE")) return colours;
  int low = 0;
  int high = 255;
  if (const auto range = draft.find("COLOR PALETTE", "RANGE")) {
    const std::string place = Draft::place("COLOR PALETTE", "RANGE");
    const auto ends = parts_of(*range);
    if (ends.size() != 2) throw Fault{place, fmt::format("\"{}\" is not of the form 0,255", *range)};
    low = Draft::whole_in(ends[0], place, -1000000, 1000000);
    high = Draft::whole_in(ends[1], place, -1000000, 1000000);
    if (high <= low) throw Fault{place, fmt::format("\"{}\" holds no values", *range)};
  }
  const auto form = draft.find("COLOR PALETTE", "FORM");
  if (form && lower(*form) != "rgb") {
    throw Fault{Draft::place("COLOR PALETTE", "FORM"), fmt::format("\"{}\" is not RGB", *form)};
  }
  for (const auto& [key, value] : draft.all("COLOR TABLE")) {
    const std::string place = Draft::place("COLOR TABLE", key);
    const int index = Draft::whole_in(key, place, 1, max_shafts);
    const auto parts = parts_of(value);
    if (parts.size() != 3) throw Fault{place, fmt::format("\"{}\" is not red, green, blue", value)};
    V3f colour;
    for (unsigned i = 0; i < 3; ++i) {
      const int level = Draft::whole_in(parts[i], place, low, high);
      const double coded = static_cast<double>(level - low) / (high - low);
      colour[i] =
          static_cast<float>(coded <= 0.04045 ? coded / 12.92 : std::pow((coded + 0.055) / 1.055, 2.4));
    }
    if (colours.size() < static_cast<std::size_t>(index)) {
      colours.resize(index, V3f(-1));
    }
    colours[index - 1] = colour;
  }
  return colours;
}

/// Warp or weft: what each of its yarns is like.
struct System {
  std::vector<Yarn> yarns;
  std::vector<double> room_mm;
};

struct SystemNames {
  std::string section;  ///< "WARP"
  V3f albedo;           ///< of yarns without a colour
};

System system_of(const Draft& draft, const SystemNames& names, const std::vector<V3f>& palette,
                 std::set<std::string>& remarks) {
  const std::string& section = names.section;
  draft.need(section);
  const int threads = draft.whole(section, "THREADS", 1, max_wif_threads);
  double unit = 10;
  const std::string unit_name = lower(draft.find(section, "UNITS").value_or("centimeters"));
  if (unit_name.starts_with("decipoint")) {
    unit = 25.4 / 720;
  } else if (unit_name.starts_with("inch") || unit_name == "in") {
    unit = 25.4;
  } else if (unit_name == "mm" || unit_name.starts_with("millimet")) {
    unit = 1;
  } else if (unit_name != "cm" && !unit_name.starts_with("centimet")) {
    throw Fault{Draft::place(section, "UNITS"),
                fmt::format("\"{}\" is none of Decipoints, Inches and Centimeters", unit_name)};
  }
  const auto spacing = draft.positive(section, "SPACING");
  const auto thickness = draft.positive(section, "THICKNESS");
  if (!spacing && !draft.has(section + " SPACING")) {
    remarks.insert(fmt::format("{} without a spacing: {} mm", lower(section), default_spacing_mm));
  }
  const auto check_key = [&](const std::string& of, const std::string& key) {
    Draft::whole_in(key, Draft::place(of, key), 1, threads);
  };
  for (const char* what : {" SPACING", " THICKNESS", " COLORS"}) {
    for (const auto& [key, value] : draft.all(section + what)) check_key(section + what, key);
  }
  const auto colour_at = [&](const std::string& text, const std::string& place) -> V3f {
    // The number of a palette entry; some programs write its red, green and blue behind it.
    const int index = Draft::whole_in(parts_of(text).front(), place, 0, max_shafts);
    if (index == 0) return names.albedo;
    const auto at = static_cast<std::size_t>(index - 1);
    if (at >= palette.size() || palette[at].x < 0) {
      throw Fault{place, fmt::format("color {} is not in [COLOR TABLE]", index)};
    }
    return palette[at];
  };
  const auto usual_colour = draft.find(section, "COLOR");
  const V3f usual = usual_colour ? colour_at(*usual_colour, Draft::place(section, "COLOR")) : names.albedo;
  const auto& colours = draft.all(section + " COLORS");
  System system;
  for (int k = 1; k <= threads; ++k) {
    const std::string key = std::to_string(k);
    Yarn yarn;
    yarn.name = fmt::format("{} {}", lower(section), k);
    const auto own = colours.find(key);
    yarn.albedo = own == colours.end() || own->second.empty()
                      ? usual
                      : colour_at(own->second, Draft::place(section + " COLORS", key));
    const auto own_spacing =
        draft.has(section + " SPACING") ? draft.positive(section + " SPACING", key) : std::nullopt;
    const auto own_thickness =
        draft.has(section + " THICKNESS") ? draft.positive(section + " THICKNESS", key) : std::nullopt;
    const double room = own_spacing ? *own_spacing * unit : (spacing ? *spacing * unit : default_spacing_mm);
    // Round yarns of more than their room would lie on top of each other.
    const double wanted = own_thickness ? *own_thickness * unit : (thickness ? *thickness * unit : room);
    yarn.radius_mm = 0.5 * std::min(wanted, room);
    if (wanted > room)
      remarks.insert(fmt::format("{} thicker than its spacing: as thick as that", lower(section)));
    system.yarns.push_back(yarn);
    system.room_mm.push_back(room);
  }
  return system;
}

/// Whether warp i is over weft j.
std::vector<bool> drawdown_of(const Draft& draft, int warps, int wefts, std::set<std::string>& remarks) {
  draft.need("WEAVING");
  const int shafts = draft.whole("WEAVING", "SHAFTS", 1, max_shafts);
  bool rising = true;
  if (const auto text = draft.find("WEAVING", "RISING SHED")) {
    const auto value = Draft::truth(*text);
    if (!value)
      throw Fault{Draft::place("WEAVING", "RISING SHED"),
                  fmt::format("\"{}\" is neither true nor false", *text)};
    rising = *value;
  }
  draft.need("THREADING");
  const auto threading = draft.lists("THREADING", warps, shafts);
  std::vector<std::vector<int>> lifted(static_cast<std::size_t>(wefts));
  if (draft.has("LIFTPLAN")) {
    lifted = draft.lists("LIFTPLAN", wefts, shafts);
  } else {
    if (!draft.has("TREADLING")) throw Fault{"[TREADLING]", "the section is missing, and [LIFTPLAN] as well"};
    draft.need("TIEUP");
    const int treadles = draft.whole("WEAVING", "TREADLES", 1, max_shafts);
    const auto tieup = draft.lists("TIEUP", treadles, shafts);
    const auto treadling = draft.lists("TREADLING", wefts, treadles);
    for (std::size_t j = 0; j < lifted.size(); ++j) {
      for (const int treadle : treadling[j]) {
        const auto& tied = tieup[treadle - 1];
        lifted[j].insert(lifted[j].end(), tied.begin(), tied.end());
      }
    }
  }
  std::vector<bool> over;
  std::vector<bool> is_lifted(static_cast<std::size_t>(shafts) + 1);
  for (const auto& shafts_of_weft : lifted) {
    std::fill(is_lifted.begin(), is_lifted.end(), false);
    for (const int shaft : shafts_of_weft) is_lifted[shaft] = true;
    for (const auto& shafts_of_warp : threading) {
      const bool named = std::any_of(shafts_of_warp.begin(), shafts_of_warp.end(),
                                     [&](int shaft) { return is_lifted[shaft]; });
      over.push_back(named == rising);
    }
  }
  const auto count_unthreaded =
      std::count_if(threading.begin(), threading.end(), [](const auto& t) { return t.empty(); });
  if (count_unthreaded > 0) {
    remarks.insert(fmt::format("{} warp yarns are on no shaft: never lifted", count_unthreaded));
  }
  return over;
}

/// A number for each of `count` things, the same for those of the same description.
template <class Describe>
std::vector<std::size_t> kinds_of(std::size_t count, const Describe& describe) {
  std::map<std::string, std::size_t> known;
  std::vector<std::size_t> kinds;
  for (std::size_t k = 0; k < count; ++k)
    kinds.push_back(known.try_emplace(describe(k), known.size()).first->second);
  return kinds;
}

/// The least number of first elements that all others repeat, at least twice over; else their count.
std::size_t repeat_of(const std::vector<std::size_t>& kinds) {
  for (std::size_t period = 1; 2 * period <= kinds.size(); ++period) {
    if (std::equal(kinds.begin() + static_cast<std::ptrdiff_t>(period), kinds.end(), kinds.begin()))
      return period;
  }
  return kinds.size();
}

std::string description_of(const System& system, std::size_t k) {
  const Yarn& yarn = system.yarns[k];
  return fmt::format("{} {} {} {} {} ", yarn.albedo.x, yarn.albedo.y, yarn.albedo.z, yarn.radius_mm,
                     system.room_mm[k]);
}

Weave smallest_repeat(const System& warp, const System& weft, const std::vector<bool>& over) {
  const std::size_t warps = warp.yarns.size();
  const std::size_t wefts = weft.yarns.size();
  const std::size_t across = repeat_of(kinds_of(warps, [&](std::size_t i) {
    std::string text = description_of(warp, i);
    for (std::size_t j = 0; j < wefts; ++j) text += over[j * warps + i] ? '#' : '-';
    return text;
  }));
  const std::size_t up = repeat_of(kinds_of(wefts, [&](std::size_t j) {
    std::string text = description_of(weft, j);
    for (std::size_t i = 0; i < warps; ++i) text += over[j * warps + i] ? '#' : '-';
    return text;
  }));
  const auto first = [](const auto& from, std::size_t count) {
    return std::decay_t<decltype(from)>(from.begin(), from.begin() + static_cast<std::ptrdiff_t>(count));
  };
  Weave weave{first(warp.yarns, across),
              first(weft.yarns, up),
              first(warp.room_mm, across),
              first(weft.room_mm, up),
              {}};
  for (std::size_t j = 0; j < up; ++j) {
    for (std::size_t i = 0; i < across; ++i) weave.warp_is_over.push_back(over[j * warps + i]);
  }
  return weave;
}

WifDraft draft_of(const WifSections& sections) {
  const Draft draft(sections);
  if (!sections.contains("WIF")) throw Fault{"[WIF]", "the section is missing: not a WIF file"};
  std::set<std::string> remarks;
  const std::vector<V3f> palette = palette_of(draft);
  if (palette.empty()) remarks.insert("no colours: off-white warp and blue weft");
  const System warp = system_of(draft, {"WARP", {0.62F, 0.58F, 0.50F}}, palette, remarks);
  const System weft = system_of(draft, {"WEFT", {0.09F, 0.17F, 0.38F}}, palette, remarks);
  if (warp.yarns.size() * weft.yarns.size() > max_wif_drawdown) {
    throw Fault{"[WEFT] Threads", fmt::format("{} x {} yarns are more than {} crossings", warp.yarns.size(),
                                              weft.yarns.size(), max_wif_drawdown)};
  }
  WifDraft result;
  result.title = draft.find("TEXT", "TITLE").value_or("");
  result.warp_threads = static_cast<int>(warp.yarns.size());
  result.weft_threads = static_cast<int>(weft.yarns.size());
  const auto over = drawdown_of(draft, result.warp_threads, result.weft_threads, remarks);
  result.weave = smallest_repeat(warp, weft, over);
  const std::size_t across = result.weave.warp.size();
  const std::size_t up = result.weave.weft.size();
  result.remarks.push_back(fmt::format(
      "{} x {} yarns, smallest repeat {} x {}{}", result.warp_threads, result.weft_threads, across, up,
      warp.yarns.size() % across + weft.yarns.size() % up > 0 ? ", the incomplete repeat at the end left out"
                                                              : ""));
  result.remarks.insert(result.remarks.end(), remarks.begin(), remarks.end());
  if (across * up > max_wif_crossings) {
    const V2i texels = texels_for(result.weave);
    throw Fault{
        "", fmt::format(
                "its smallest repeat has {} x {} yarns and would need {} x {} texels; at most {} crossings "
                "are made",
                across, up, texels.x, texels.y, max_wif_crossings)};
  }
  return result;
}

int texels_along(const std::vector<double>& rooms) {
  double sum = 0;
  for (const double room : rooms) sum += room;
  return static_cast<int>(
      std::ceil(texels_per_yarn * sum / *std::min_element(rooms.begin(), rooms.end()) - 1e-9));
}

}  // namespace

V2i texels_for(const Weave& weave) { return {texels_along(weave.warp_mm), texels_along(weave.weft_mm)}; }

Result<WifDraft> read_wif(std::string_view text, const std::string& file) {
  if (text.size() > max_wif_text) {
    return fail(Code::file_too_large, file, "",
                fmt::format("{} bytes, a weaving draft has at most {}", text.size(), max_wif_text));
  }
  const auto sections = read_wif_sections(text, file);
  if (!sections) return tl::unexpected(sections.error());
  try {
    return draft_of(*sections);
  } catch (const Fault& fault) {
    return fail(Code::stitch_invalid, file, fault.place, fault.message);
  }
}

}  // namespace selvedge
