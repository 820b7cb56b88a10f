#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "format/fabric/yarns.h"
#include "tests/format/yarn_data.h"

using namespace selvedge;
using namespace selvedge::test;

TEST_CASE("refuses yarn that cannot be traced") {
  const V2f period(2, 2);
  const auto place = [&](const auto& change) {
    YarnData data = straight(2, 0.5F);
    change(data);
    const auto ok = validate(data, period);
    REQUIRE_FALSE(ok);
    return ok.error().place;
  };
  CHECK(place([](YarnData& d) { d.curves.clear(); }) == "curves");
  CHECK(place([](YarnData& d) { d.curves[0].radius = 0; }) == "curve 0");
  CHECK(place([](YarnData& d) { d.curves[0].radius = 4.1F; }) == "curve 0");
  CHECK(place([](YarnData& d) { d.curves[0].albedo.y = 1.1F; }) == "curve 0");
  CHECK(place([](YarnData& d) { d.curves[0].gloss.roughness = 0; }) == "curve 0");
  CHECK(place([](YarnData& d) { d.curves[0].turns.x = 65; }) == "curve 0");
  CHECK(place([](YarnData& d) { d.curves[0].nodes = 5; }) == "curve 0");
  CHECK(place([](YarnData& d) { d.curves[0].nodes = 3; }) == "nodes");
  CHECK(place([](YarnData& d) { d.curves[0].stations = 2; }) == "light");
  CHECK(place([](YarnData& d) { d.nodes[2] = d.nodes[1]; }) == "node 1");
  CHECK(place([](YarnData& d) { d.nodes[3].z = std::nanf(""); }) == "node 3");
  CHECK(place([](YarnData& d) { d.nodes[3].x = 200; }) == "node 3");
  CHECK(place([](YarnData& d) { d.light[7] = std::numeric_limits<float>::infinity(); }) == "light");
}
