// Escapes in text from files and file names, so that it can be printed.
#pragma once

#include <string>
#include <string_view>

namespace selvedge {

/// Replaces each byte that is not valid UTF-8 (RFC 3629) by "\xNN". For JSON, which escapes the others
/// itself.
std::string as_utf8(std::string_view text);

/// As as_utf8(), for a terminal or a log: control characters (C0, DEL, C1) except line ends and tabs become
/// "\xNN" as well.
std::string printable(std::string_view text);

}  // namespace selvedge
