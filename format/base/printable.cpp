#include "format/base/printable.h"

#include <fmt/format.h>

#include <cstddef>

namespace selvedge {
namespace {

unsigned byte_at(std::string_view text, std::size_t at) {
  return at < text.size() ? static_cast<unsigned char>(text[at]) : 0;
}

/// Length of the UTF-8 sequence at the text's beginning; 0 for invalid ones, including overlong forms,
/// surrogates and numbers beyond U+10FFFF (table 3-7 of the Unicode standard).
std::size_t sequence_length(std::string_view text) {
  const unsigned first = byte_at(text, 0);
  const unsigned second = byte_at(text, 1);
  const auto follows = [&](std::size_t at) { return (byte_at(text, at) & 0xC0U) == 0x80U; };
  if (first < 0x80) return 1;
  if (first < 0xC2 || first > 0xF4 || !follows(1)) return 0;
  if (first < 0xE0) return 2;
  if ((first == 0xE0 && second < 0xA0) || (first == 0xED && second > 0x9F) || !follows(2)) return 0;
  if (first < 0xF0) return 3;
  if ((first == 0xF0 && second < 0x90) || (first == 0xF4 && second > 0x8F) || !follows(3)) return 0;
  return 4;
}

bool is_control(std::string_view text, std::size_t length) {
  const unsigned first = byte_at(text, 0);
  if (length == 2) return first == 0xC2 && byte_at(text, 1) < 0xA0;
  return length == 1 && (first < 0x20 || first == 0x7F) && first != '\n' && first != '\t';
}

std::string escape(std::string_view text, bool controls) {
  std::string escaped;
  while (!text.empty()) {
    const std::size_t length = sequence_length(text);
    const std::string_view sequence = text.substr(0, length == 0 ? 1 : length);
    if (length == 0 || (controls && is_control(text, length)))
      for (const char c : sequence) escaped += fmt::format("\\x{:02X}", static_cast<unsigned char>(c));
    else
      escaped += sequence;
    text.remove_prefix(sequence.size());
  }
  return escaped;
}

}  // namespace

std::string escape_invalid_utf8(std::string_view text) { return escape(text, false); }

std::string escape_unprintable(std::string_view text) { return escape(text, true); }

}  // namespace selvedge
