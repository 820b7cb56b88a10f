#include "format/base/printable.h"

#include <doctest/doctest.h>

#include <optional>
#include <stdexcept>
#include <string>

#include "format/base/error.h"
#include "format/base/json_text.h"

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

TEST_CASE("json text: what its limits or a repeated member end is named, and its values are counted") {
  using Kind = JsonFault::Kind;
  struct Case {
    std::string text;
    std::optional<Kind> fault;
    std::string place{};
  };
  for (const Case& c : {
           Case{R"({"a":1,"b":2,"a":3})", Kind::repeated, "/a"},
           {R"({"a":[0,{"x":1},[2],{"b/c":{"~":1,"y":2,"~":[]}}]})", Kind::repeated, "/a/3/b~1c/~0"},
           {R"([[],[{},{"n":null,"n":null}]])", Kind::repeated, "/1/1/n"},
           {R"({"a":1,"\u0061":2})", Kind::repeated, "/a"},  // the same name, written otherwise
           {R"({"a":{"a":1},"b":[{"a":1},{"a":2.5}],"c":"}]{{","d":true})", {}},
           {"3", {}},
           {R"({"a":1,"b":2,"c":3,"d":4,"e":5})", Kind::members},
           {std::string(1'000'000, '['), Kind::nesting},
           {"[1,2,3,4,5,6,7,8,9,10,11,12]", Kind::values},
       }) {
    CAPTURE(c.text.substr(0, 100));
    JsonLimits limits{5, 4, 12};
    std::optional<JsonFault> fault;
    try {
      static_cast<void>(parse_json(c.text, limits));
    } catch (const JsonFault& thrown) {
      fault = thrown;
    }
    CHECK(fault.has_value() == c.fault.has_value());
    if (fault) CHECK(fault->kind == *c.fault);
    if (fault) CHECK(fault->place == c.place);
    if (c.text == "3") CHECK(limits.values == 11);
  }
  for (const char* text : {R"({"a":1,)", "", "\xEF\xBB\xBF{}", R"({"a":1,"a":1})", "1e999"})
    CHECK(parse_json(text).is_discarded());
}

TEST_CASE("json text: reasons are without the number that the parser puts before them") {
  const auto reason = [](const char* text) -> std::string {
    try {
      (void)nlohmann::json::parse(text).get<int>();
    } catch (const std::exception& error) {
      return exception_message(error);
    }
    return "";
  };
  CHECK(reason("\"a\"") == "type must be number, but is string");
  CHECK(reason("[1,]").starts_with("parse error at line 1, column 4"));
  CHECK(exception_message(std::runtime_error("[1] is no number")) == "[1] is no number");
}
