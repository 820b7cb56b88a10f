#include "converter/stitch/wif_sections.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

namespace selvedge {
namespace {

std::string trimmed(std::string_view text) {
  constexpr std::string_view blanks = " \t\0";
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return "";
  return std::string(text.substr(first, text.find_last_not_of(blanks) - first + 1));
}

std::string upper(std::string text) {
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

std::optional<double> number_in(std::string_view text) {
  double value = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc() || result.ptr != text.data() + text.size()) return std::nullopt;
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

}  // namespace

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

std::vector<std::string> parts_of(const std::string& text) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == ',')
      parts.emplace_back();
    else if (c != ' ' && c != '\t')
      parts.back() += c;
  }
  return parts;
}

Result<WifSections> WifSections::read(std::string_view text, const std::string& file) {
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff")) {
    return fail(Code::stitch_invalid, file, "", "is UTF-16; a WIF file has one byte per character");
  }
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  WifSections result;
  auto& sections = result.sections_;
  std::map<std::string, std::string>* current = nullptr;
  std::map<std::string, std::string> repeated;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
    const std::string line = trimmed(text.substr(0, end));
    const bool pair = text.substr(end).starts_with("\r\n");
    text.remove_prefix(std::min(end + (pair ? 2 : 1), text.size()));
    if (line.empty() || line.front() == ';') continue;
    const auto refuse = [&](std::string why) {
      return fail(Code::stitch_invalid, file, fmt::format("line {}", number), std::move(why));
    };
    if (line.size() > max_wif_line) return refuse(fmt::format("has more than {} bytes", max_wif_line));
    if (line.front() == '[') {
      const std::size_t close = line.find(']');
      if (close == std::string::npos) return refuse("a section's name has no closing bracket");
      const auto [section, is_new] = sections.try_emplace(upper(trimmed(line.substr(1, close - 1))));
      current = is_new ? &section->second : &repeated;
      continue;
    }
    if (current == nullptr) return refuse("stands before the first section: not a WIF file");
    const std::size_t equals = line.find('=');
    if (equals == std::string::npos) return refuse("is neither a section nor of the form key=value");
    current->try_emplace(upper(trimmed(line.substr(0, equals))), trimmed(line.substr(equals + 1)));
  }
  if (sections.empty()) return fail(Code::stitch_invalid, file, "", "has no section: not a WIF file");
  return result;
}

bool WifSections::has(const std::string& section) const {
  const auto listed = find("CONTENTS", section);
  return sections_.contains(section) && (listed ? truth(*listed).value_or(true) : true);
}

std::optional<std::string> WifSections::find(const std::string& section, const std::string& key) const {
  const auto at = sections_.find(section);
  if (at == sections_.end()) return std::nullopt;
  const auto value = at->second.find(key);
  if (value == at->second.end() || value->second.empty()) return std::nullopt;
  return value->second;
}

const std::map<std::string, std::string>& WifSections::all(const std::string& section) const {
  static const std::map<std::string, std::string> none;
  return has(section) ? sections_.at(section) : none;
}

void WifSections::need(const std::string& section) const {
  if (!sections_.contains(section)) throw WifFault{"[" + section + "]", "the section is missing"};
  if (!has(section)) throw WifFault{"[" + section + "]", "is needed, but [CONTENTS] says that there is none"};
}

std::string WifSections::place(const std::string& section, const std::string& key) {
  return fmt::format("[{}] {}", section, key);
}

std::optional<bool> WifSections::truth(const std::string& text) {
  const std::string word = lower(text);
  if (word == "true" || word == "yes" || word == "on" || word == "1") return true;
  if (word == "false" || word == "no" || word == "off" || word == "0") return false;
  return std::nullopt;
}

int WifSections::whole_in(const std::string& text, const std::string& place, int min, int max) {
  const auto value = number_in(text);
  if (!value || *value != std::floor(*value)) {
    throw WifFault{place, fmt::format("\"{}\" is not a whole number", text)};
  }
  if (*value < min || *value > max) {
    throw WifFault{place, fmt::format("must lie in {} to {}, is {}", min, max, text)};
  }
  return static_cast<int>(*value);
}

int WifSections::whole(const std::string& section, const std::string& key, int min, int max) const {
  const auto text = find(section, key);
  if (!text) throw WifFault{place(section, key), "is missing"};
  return whole_in(*text, place(section, key), min, max);
}

std::optional<double> WifSections::positive_in(const std::string& text, const std::string& place) {
  const auto value = number_in(text);
  if (!value || *value < 0) throw WifFault{place, fmt::format("\"{}\" is not a number of at least 0", text)};
  return *value > 0 ? value : std::nullopt;
}

std::vector<WifSet> WifSections::sets(const std::string& section, int count, int max) const {
  std::vector<WifSet> sets(count);
  for (const auto& [key, value] : all(section)) {
    if (value.empty() || value == "0") continue;  // also behind the last one, where some programs write it
    const int index = whole_in(key, place(section, key), 1, count);
    for (const std::string& part : parts_of(value))
      sets[index - 1].set(whole_in(part, place(section, key), 0, max));
    sets[index - 1].reset(0);
  }
  return sets;
}

}  // namespace selvedge
