// Splits the text of a WIF file into sections of keys and values, and parses values; wif.h interprets them.
#pragma once

#include <bitset>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "format/base/error.h"

namespace selvedge {

/// A missing section or key, or a wrong value: thrown here, caught by read_wif().
struct WifFault {
  std::string place;
  std::string message;
};

/// Greatest number of shafts, treadles and colours, and a set of some of them.
constexpr int max_shafts = 4096;
using WifSet = std::bitset<max_shafts + 1>;

/// Longest line, bytes: room for all numbers of a set.
constexpr std::size_t max_wif_line = 1U << 16U;

std::string lower(std::string text);

/// Splits "1, 2,3" at commas and trims the parts; parts may be empty.
std::vector<std::string> parts_of(const std::string& text);

class WifSections {
 public:
  /// Accepts names in any case, lines that end in LF, CRLF or CR, a byte order mark, empty lines, comments
  /// that begin with ";" at the start of a line, any single-byte encoding or UTF-8. The first of repeated
  /// sections or keys is used. Refuses (stitch_invalid, place: the line) lines before the first section and
  /// lines that are neither a section nor a key or too long, UTF-16, and texts without sections.
  static Result<WifSections> read(std::string_view text, const std::string& file);

  // Names of sections and keys are in upper case.

  /// Whether the section exists and [CONTENTS] does not disable it.
  bool has(const std::string& section) const;
  /// The value, if it is not empty.
  std::optional<std::string> find(const std::string& section, const std::string& key) const;
  /// Keys and values; empty if has() is false.
  const std::map<std::string, std::string>& all(const std::string& section) const;
  /// Throws if has() is false.
  void need(const std::string& section) const;

  /// "[section] key", for messages.
  static std::string place(const std::string& section, const std::string& key);
  static std::optional<bool> truth(const std::string& text);
  /// Throws unless the text is a whole number from `min` to `max`.
  static int whole_in(const std::string& text, const std::string& place, int min, int max);
  int whole(const std::string& section, const std::string& key, int min, int max) const;
  /// Throws unless the text is a number >= 0; nothing for 0, which some programs write for "not given".
  static std::optional<double> positive_in(const std::string& text, const std::string& place);

  /// The values of entries 1 to `count` of a section; `default_value` if there is no entry or parse(text,
  /// place) returns nothing.
  template <class Value, class Parse>
  std::vector<Value> values(const std::string& section, int count, const Value& default_value,
                            const Parse& parse) const {
    std::vector<Value> values(count, default_value);
    for (const auto& [key, text] : all(section)) {
      const int index = whole_in(key, place(section, key), 1, count);
      if (text.empty()) continue;
      if (const auto parsed = parse(text, place(section, key))) values[index - 1] = *parsed;
    }
    return values;
  }
  /// Entries 1 to `count` of a section, each a list of numbers from 0 (ignored) to `max`, at most max_shafts;
  /// none if the entry is missing.
  std::vector<WifSet> sets(const std::string& section, int count, int max) const;

 private:
  std::map<std::string, std::map<std::string, std::string>> sections_;
};

}  // namespace selvedge
