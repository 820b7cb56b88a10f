#include "format/base/words.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstdlib>

namespace selvedge {

void split_words(std::string_view line, Words& words) {
  constexpr std::string_view blanks = " \t\r\v\f";
  words.clear();
  for (std::size_t end = 0;;) {
    const std::size_t begin = line.find_first_not_of(blanks, end);
    if (begin == std::string_view::npos) return;
    end = std::min(line.find_first_of(blanks, begin), line.size());
    words.push_back(line.substr(begin, end - begin));
  }
}

std::string_view rest_of(const Words& words, std::size_t first) {
  if (words.size() <= first) return {};
  const char* begin = words[first].data();
  return {begin, static_cast<std::size_t>(words.back().data() + words.back().size() - begin)};
}

bool to_number(std::string_view word, double& value) {
  if (word.starts_with('+')) word.remove_prefix(1);
  const char* end = word.data() + word.size();
  const auto result = std::from_chars(word.data(), end, value);
  if (result.ec == std::errc::result_out_of_range) value = std::strtod(std::string(word).c_str(), nullptr);
  return result.ec != std::errc::invalid_argument && result.ptr == end;
}

Result<V3d> position_at(const Words& words, std::size_t first, const std::string& file, int number) {
  const auto place = [&] { return fmt::format("line {}", number); };
  V3d point;
  for (std::size_t i = 0; i < 3; ++i) {
    double& value = point[static_cast<int>(i)];
    if (first + i >= words.size() || !to_number(words[first + i], value)) {
      return fail(Code::file_damaged, file, place(), "a vertex needs three numbers");
    }
    if (!std::isfinite(static_cast<float>(value))) {
      return fail(Code::mesh_not_finite, file, place(), "a vertex is NaN, infinite or beyond a float");
    }
    value += 0.0;  // -0 and 0 become the same bits
  }
  return point;
}

std::string obj_text(std::string_view text) {
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  std::string plain;
  std::string pending_ends;  // line ends of continued lines
  bool comment = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    char c = text[i];
    if (c == '\r' && i + 1 < text.size() && text[i + 1] == '\n') continue;
    if (c == '\r') c = '\n';
    if (c == '\n' && plain.ends_with('\\') && !comment) {
      plain.back() = ' ';
      pending_ends += '\n';
      continue;
    }
    if (c == '#') comment = true;
    if (c == '\n') {
      comment = false;
      plain += pending_ends;
      pending_ends.clear();
    }
    if (!comment) plain += c;
  }
  return plain + pending_ends;
}

bool to_obj_index(std::string_view word, std::size_t count, int& index) {
  const char* end = word.data() + word.size();
  int number = 0;
  const auto result = std::from_chars(word.data(), end, number);
  if (result.ec == std::errc::invalid_argument || result.ptr != end) return false;
  index = number > 0 ? number - 1 : (number < 0 ? static_cast<int>(count) + number : -1);
  return true;
}

}  // namespace selvedge
