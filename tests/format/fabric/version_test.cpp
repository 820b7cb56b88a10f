// The version of fabric files, and the members that later versions may fill.
#include <doctest/doctest.h>

#include <nlohmann/json.hpp>

#include "format/fabric/header.h"
#include "tests/format/fabrics.h"

using namespace selvedge;
using nlohmann::json;

namespace {

/// The first issue of a header with these members; "" for a good one.
std::string verdict(const json& changes) {
  json text = json::parse(header_to_json(header_without_layers(test::lambert_fabric(2, 2, V3f(0.5F)))));
  text.merge_patch(changes);
  IssueSink sink("a.exr");
  const auto header = header_from_json(text.dump(), {}, sink);
  CHECK(header.has_value() == !sink.has_error());
  return header ? "" : to_line(sink.first_error());
}

}  // namespace

TEST_CASE("files of 4.x are read; files of 3.x are refused in a line that names make") {
  CHECK(verdict(json::object()).empty());
  CHECK(verdict({{"version", {4, 7}}}).empty());
  CHECK(verdict({{"version", {3, 1}}}) ==
        "a.exr: /version: fabric version 3.1 is no longer read: make the fabric again with 'selvedge make' "
        "[FABRIC_VERSION]");
  CHECK(verdict({{"version", {6, 0}}}).find("[FABRIC_VERSION]") != std::string::npos);
  CHECK(verdict({{"version", "4.0"}}).find("[FABRIC_MEMBER]") != std::string::npos);
}
