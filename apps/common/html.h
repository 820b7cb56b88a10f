// Text of web pages.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace selvedge {

/// Text within an element or an attribute in double quotes. Bytes that are not UTF-8 and control characters
/// are replaced as on a terminal.
std::string escape_html(const std::string& text);

std::string base64(std::span<const std::uint8_t> bytes);

}  // namespace selvedge
