// Text that came out of a file or a file's name, made fit to be shown.
#pragma once

#include <string>
#include <string_view>

namespace selvedge {

/// Valid UTF-8: bytes that are not (RFC 3629) become "\xNN" each. For JSON, which has escapes for the rest.
std::string as_utf8(std::string_view text);

/// The same for a terminal or a log: control characters (C0, DEL, C1) become "\xNN" as well, but for line
/// ends and tabs.
std::string printable(std::string_view text);

}  // namespace selvedge
