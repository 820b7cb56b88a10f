// Escapes in text from files and file names, so that it can be printed.
#pragma once

#include <string>
#include <string_view>

namespace selvedge {

/// Replaces each byte that is not valid UTF-8 (RFC 3629) by "\xNN". For JSON, which escapes the others
/// itself.
std::string escape_invalid_utf8(std::string_view text);

/// As escape_invalid_utf8(), for a terminal or a log: control characters (C0, DEL, C1) except line ends and
/// tabs become
/// "\xNN" as well.
std::string escape_unprintable(std::string_view text);

}  // namespace selvedge
