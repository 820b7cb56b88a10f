#include "format/base/json_text.h"

#include <doctest/doctest.h>

#include <optional>
#include <stdexcept>
#include <string>

using namespace selvedge;

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
