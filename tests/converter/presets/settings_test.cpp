#include "converter/presets/settings.h"

#include <doctest/doctest.h>

#include <set>

using namespace selvedge;

TEST_CASE("the usual grid begins with what make does by default, and has each point once") {
  const std::vector<TradePoint> points = default_grid();
  REQUIRE(points.size() > 20);
  CHECK(points.size() <= 100);
  CHECK(points.front() == TradePoint());
  CHECK(options_text(points.front()).empty());
  std::set<std::string> names;
  std::set<std::string> options;
  for (const TradePoint& point : points) {
    names.insert(name_of(point));
    options.insert(options_text(point));
  }
  CHECK(names.size() == points.size());
  CHECK(options.size() == points.size());
}

TEST_CASE("a grid varies one knob at a time around its centre") {
  const auto points = read_grid(R"({"centre": {"texels": 16, "lobes": 1},
    "vary": {"lobes": [1, 3], "directions": [36]}, "points": [{"bounces": "unlimited", "texels": 32}]})",
                                "g.json");
  REQUIRE_MESSAGE(points, to_line(points.error()));
  REQUIRE(points->size() == 4);
  CHECK(name_of((*points)[0]) == "t16-v64-l64-s8-b2-paper-1lobes-mixed");
  CHECK(options_text((*points)[1]) == " --texels 16 --views 36 --lights 36 --lobes 1");
  CHECK((*points)[2].lobes == 3);
  CHECK(options_text((*points)[3]) == " --bounces unlimited --lobes 1");
}

TEST_CASE("the centre's budget is for the points that choose their layers within one") {
  const auto points =
      read_grid(R"({"centre": {"budget": 9000}, "vary": {"layers": ["slabs", "paper"]}})", "g.json");
  REQUIRE_MESSAGE(points, to_line(points.error()));
  REQUIRE(points->size() == 2);
  CHECK((*points)[0] == TradePoint());
  CHECK((*points)[1].budget == 9000);
}

TEST_CASE("points that differ in the fit alone share a bake") {
  TradePoint a;
  TradePoint b;
  b.lobes = 1;
  b.storage = Storage::half;
  b.layers = LayerChoice::products;
  b.budget = 1000;
  CHECK(bake_name_of(a) == bake_name_of(b));
  CHECK(name_of(a) != name_of(b));
  b.layers = LayerChoice::slabs;
  CHECK(bake_name_of(a) != bake_name_of(b));
}

TEST_CASE("a grid that cannot be swept is refused with the knob as its place") {
  const auto refused = [](const char* text, const char* place, Code code = Code::option_out_of_range) {
    CAPTURE(text);
    const auto points = read_grid(text, "g.json");
    REQUIRE_FALSE(points);
    CHECK(points.error().code == code);
    CHECK(points.error().file == "g.json");
    CHECK(points.error().place == place);
  };
  refused("[]", "", Code::json_malformed);
  refused("{", "line 1, column 2", Code::json_malformed);
  refused("{\n  \"vary\": 1e999}", "", Code::json_malformed);
  refused(R"({"points": [{"lobes": 1, "lobes": 2}]})", "/points/0/lobes", Code::json_malformed);
  refused(R"({"knobs": {}})", "/knobs");
  refused(R"({"centre": {"texel": 8}})", "/centre/texel");
  refused(R"({"centre": {"texels": 8.5}})", "/centre/texels");
  refused(R"({"vary": {"layers": ["papier"]}})", "/vary/layers");
  refused(R"({"vary": {"bounces": [-1]}})", "/vary/bounces");
  refused(R"({"points": [{"lobes": 1}, {"views": 0}]})", "/points/1/views");
  refused(R"({"points": [3]})", "/points/0");
  // Of a point by its name, whichever values have come together there.
  refused(R"({"vary": {"texels": [24]}})", "");
  refused(R"({"vary": {"layers": ["slabs"]}})", "");
  // Contradictions, and what would be measured twice or for nothing.
  refused(R"({"centre": {"directions": 16, "views": 9}})", "/centre/directions");
  refused(R"({"points": [{"lights": 9, "directions": 16}]})", "/points/0/directions");
  refused(R"({"points": [{"budget": 9000}]})", "/points/0/budget");
  refused(R"({"vary": {"budget": [9000, 20000]}})", "/vary/budget");
  refused(R"({"centre": {"budget": 9000}, "vary": {"lobes": [1]}})", "/centre/budget");
  refused(R"({"vary": {"lobes": [1, 3, 1]}})", "/vary/lobes/2");
  refused(R"({"vary": {"lobes": [1]}, "points": [{"lobes": 1}]})", "/points/0");
  refused(R"({"points": [{}]})", "/points/0");
  refused(R"({"points": [{"texels": 16}, {"texels": 16, "lobes": 2}]})", "/points/1");
}
