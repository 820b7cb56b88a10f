#include "format/exr/bytes.h"

namespace selvedge {
namespace {

/// Length of the UTF-8 sequence that begins with `lead`, or 0.
std::size_t sequence_length(unsigned char lead) {
  if (lead < 0x80) return 1;
  if (lead >= 0xC2 && lead < 0xE0) return 2;
  if (lead >= 0xE0 && lead < 0xF0) return 3;
  return lead >= 0xF0 && lead < 0xF5 ? 4 : 0;
}

/// Second bytes that a lead byte does not allow: C1 controls, longer forms than needed, surrogates, and what
/// is beyond the last code point.
bool is_forbidden(unsigned char lead, unsigned char next) {
  return (lead == 0xC2 && next < 0xA0) || (lead == 0xE0 && next < 0xA0) || (lead == 0xED && next >= 0xA0) ||
         (lead == 0xF0 && next < 0x90) || (lead == 0xF4 && next >= 0x90);
}

}  // namespace

bool is_printable(std::string_view name) {
  while (!name.empty()) {
    const auto lead = static_cast<unsigned char>(name.front());
    const std::size_t length = sequence_length(lead);
    if (lead < 0x20 || lead == 0x7F || length == 0 || length > name.size()) return false;
    for (const char c : name.substr(1, length - 1)) {
      if ((static_cast<unsigned char>(c) & 0xC0) != 0x80) return false;
    }
    if (length > 1 && is_forbidden(lead, static_cast<unsigned char>(name[1]))) return false;
    name.remove_prefix(length);
  }
  return true;
}

}  // namespace selvedge
