#include "format/base/printable.h"

#include <doctest/doctest.h>

#include "format/base/error.h"

using namespace selvedge;

TEST_CASE("printable: text that is UTF-8 stays as it is, in every length of sequence and at its bounds") {
  for (const std::string text :
       {"", "plain", "\xC2\xA0", "\xDF\xBF", "\xE0\xA0\x80", "\xED\x9F\xBF", "\xEE\x80\x80", "\xEF\xBF\xBF",
        "\xF0\x90\x80\x80", "\xF4\x8F\xBF\xBF", "Garn \xC3\xBC\xE2\x82\xAC\xF0\x9F\xA7\xB6"}) {
    CAPTURE(text);
    CHECK(escape_invalid_utf8(text) == text);
    CHECK(escape_unprintable(text) == text);
  }
}

TEST_CASE("printable: bytes that are no UTF-8 are escaped one by one, and what follows is kept") {
  CHECK(escape_invalid_utf8("a\xFFz") == "a\\xFFz");
  CHECK(escape_invalid_utf8("\x80") == "\\x80");
  CHECK(escape_invalid_utf8("\xC0\xAF") == "\\xC0\\xAF");                    // overlong
  CHECK(escape_invalid_utf8("\xE0\x9F\xBF") == "\\xE0\\x9F\\xBF");           // overlong
  CHECK(escape_invalid_utf8("\xED\xA0\x80") == "\\xED\\xA0\\x80");           // a surrogate
  CHECK(escape_invalid_utf8("\xF4\x90\x80\x80") == "\\xF4\\x90\\x80\\x80");  // beyond U+10FFFF
  CHECK(escape_invalid_utf8("\xE2\x82") == "\\xE2\\x82");                    // cut short
  CHECK(escape_invalid_utf8("\xE2\x82\xE2\x82\xAC") == "\\xE2\\x82\xE2\x82\xAC");
  CHECK(escape_invalid_utf8(std::string("\xC3\0", 2)) == std::string("\\xC3\0", 5));
}

TEST_CASE("printable: control characters are escaped for a terminal, line ends and tabs are not") {
  CHECK(escape_unprintable("red \x1B[31m\x7F") == "red \\x1B[31m\\x7F");
  CHECK(escape_unprintable("\xC2\x9B"
                           "31m") == "\\xC2\\x9B31m");  // CSI as one character
  CHECK(escape_unprintable(std::string("a\0b", 3)) == "a\\x00b");
  CHECK(escape_unprintable("a\tb\nc") == "a\tb\nc");
  CHECK(escape_invalid_utf8("red \x1B[31m") == "red \x1B[31m");
}

TEST_CASE("printable: the line of an error is one line of UTF-8, whatever its parts are") {
  const std::string line =
      to_line({Code::exr_malformed, "a\xFF.exr", "part \"\x1B[2J\"", "two\r\nlines\tand a \xC3"});
  CHECK(line == "a\\xFF.exr: part \"\\x1B[2J\": two  lines and a \\xC3 [EXR_MALFORMED]");
}
