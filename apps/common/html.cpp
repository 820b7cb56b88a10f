#include "apps/common/html.h"

#include <algorithm>

#include "format/base/printable.h"

namespace selvedge {

std::string escape_html(const std::string& text) {
  std::string result;
  for (const char c : escape_unprintable(escape_invalid_utf8(text))) {
    const char* entity = c == '&'   ? "&amp;"
                         : c == '<' ? "&lt;"
                         : c == '>' ? "&gt;"
                         : c == '"' ? "&quot;"
                                    : "";
    result += *entity == '\0' ? std::string(1, c) : entity;
  }
  return result;
}

std::string base64(std::span<const std::uint8_t> bytes) {
  static constexpr const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t bits = 0;
    for (std::size_t j = 0; j < 3; ++j) bits = bits << 8 | (j < count ? bytes[i + j] : 0U);
    for (std::size_t j = 0; j < 4; ++j) text += j <= count ? digits[bits >> (18 - 6 * j) & 63] : '=';
  }
  return text;
}

}  // namespace selvedge
