#include "format/base/json_text.h"

#include <doctest/doctest.h>

#include <stdexcept>

using namespace selvedge;

TEST_CASE("json text: a member that its object has twice is pointed at") {
  CHECK(repeated_member(R"({"a":1,"b":2,"a":3})") == "/a");
  CHECK(repeated_member(R"({"a":[0,{"x":1},[2],{"b/c":{"~":1,"y":2,"~":[]}}]})") == "/a/3/b~1c/~0");
  CHECK(repeated_member(R"([[],[{},{"n":null,"n":null}]])") == "/1/1/n");
  CHECK(repeated_member(R"({"a":1,"\u0061":2})") == "/a");  // the same name, written otherwise
  CHECK(repeated_member(R"({"a":1,"a":2,"b":1,"b":2})") == "/a");
}

TEST_CASE("json text: the same name in different objects is no repetition") {
  CHECK_FALSE(repeated_member(R"({"a":{"a":1},"b":[{"a":1},{"a":2.5}],"c":"a","d":true})"));
  CHECK_FALSE(repeated_member("3"));
  CHECK_FALSE(repeated_member(R"({"a":1,)"));
  CHECK_FALSE(repeated_member(""));
}

TEST_CASE("json text: reasons are without the number that the parser puts before them") {
  const auto reason = [](const char* text) -> std::string {
    try {
      (void)nlohmann::json::parse(text).get<int>();
    } catch (const std::exception& error) {
      return reason_of(error);
    }
    return "";
  };
  CHECK(reason("\"a\"") == "type must be number, but is string");
  CHECK(reason("[1,]").starts_with("parse error at line 1, column 4"));
  CHECK(reason_of(std::runtime_error("[1] is no number")) == "[1] is no number");
}

TEST_CASE("json text: nesting and members are counted outside of strings, and no further than wanted") {
  const JsonDemands demands = demands_of(R"({"a":[{"b":1,"c":"}]{{\"::","d":3}],"e":0})", 10);
  CHECK(demands.nesting == 3);
  CHECK(demands.members == 3);
  CHECK(demands_of(std::string(1000000, '['), 64).nesting == 65);
  CHECK(demands_of("]]]:", 64).nesting == 0);
}
