// The text of a WIF file as sections of keys and values; what they mean is wif.h.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "format/base/error.h"

namespace selvedge {

/// Section and key names in upper case, blanks around them left out; values as they stand, blanks around them
/// left out.
using WifSections = std::map<std::string, std::map<std::string, std::string>>;

/// Reads what programs write: names in any case, lines that end in LF, CRLF or CR, a byte order mark,
/// comments behind ";" at the start of a line, empty lines, any single-byte encoding or UTF-8. Of a section
/// or a key that comes twice the first counts. Refuses (stitch_invalid, place: the line) lines before the
/// first section and lines that are neither a section nor a key, UTF-16, and texts with no section.
Result<WifSections> read_wif_sections(std::string_view text, const std::string& file);

}  // namespace selvedge
