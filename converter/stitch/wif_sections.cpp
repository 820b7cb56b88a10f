#include "converter/stitch/wif_sections.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace selvedge {
namespace {

std::string trimmed(std::string_view text) {
  constexpr std::string_view blanks = " \t\0";
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return "";
  return std::string(text.substr(first, text.find_last_not_of(blanks) - first + 1));
}

std::string upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

}  // namespace

Result<WifSections> read_wif_sections(std::string_view text, const std::string& file) {
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff")) {
    return fail(Code::stitch_invalid, file, "", "is UTF-16; a WIF file has one byte per character");
  }
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  WifSections sections;
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
  return sections;
}

}  // namespace selvedge
