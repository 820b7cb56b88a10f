#include "converter/presets/make_options.h"

#include <doctest/doctest.h>

#include <nlohmann/json.hpp>

#include "tests/require.h"

using namespace selvedge;

TEST_CASE("knobs come back from their JSON, and options tell them apart") {
  const MakeOptions changed = with_knobs(
      R"({"texels": 16, "directions": 36, "samples": 2, "bounces": "unlimited", "lobes": 1, "layers": "products",
          "budget": 65536, "storage": "half"})");
  CHECK(settings_name(with_knobs(knobs_of(changed).dump())) == settings_name(changed));
  CHECK(settings_name(changed) == "t16-v36-l36-s2-bunlimited-products-1lobes-65536B-half");
  CHECK(options_text(changed) ==
        " --texels 16 --views 36 --lights 36 --samples 2 --bounces unlimited --lobes 1 --budget 65536"
        " --half-lobes");
  CHECK(options_text(MakeOptions()).empty());
  CHECK(options_text(with_knobs(R"({"layers": "no-table", "storage": "float"})")) ==
        " --no-table --float-tables");
  CHECK(options_text(with_knobs(R"({"layers": "products", "budget": 9000})")) == " --budget 9000");
}

TEST_CASE("a budget grows with texels beyond those that it is for") {
  MakeOptions options;
  options.budget = 1000;
  CHECK(options.budget_for(4096) == 1000);
  options.budget_texels = 256;
  CHECK(options.budget_for(1024) == 4000);
  CHECK(options.budget_for(64) == 1000);
}

TEST_CASE("a grid varies one knob at a time around its centre") {
  const auto points = read_grid(R"({"centre": {"texels": 16, "lobes": 1},
    "vary": {"lobes": [1, 3], "directions": [36]}, "points": [{"bounces": "unlimited", "texels": 32}]})",
                                "g.json");
  REQUIRE_MESSAGE(points, to_line(points.error()));
  REQUIRE(points->size() == 4);
  CHECK(settings_name((*points)[0]) == "t16-v64-l64-s8-b2-paper-1lobes-mixed");
  CHECK(options_text((*points)[1]) == " --texels 16 --views 36 --lights 36 --lobes 1");
  CHECK((*points)[2].fit.lobes == 3);
  CHECK(options_text((*points)[3]) == " --bounces unlimited --lobes 1");
}

TEST_CASE("the centre's budget is for the points that choose their layers within one") {
  const auto points =
      read_grid(R"({"centre": {"budget": 9000}, "vary": {"layers": ["products", "paper"]}})", "g.json");
  REQUIRE_MESSAGE(points, to_line(points.error()));
  REQUIRE(points->size() == 2);
  CHECK(settings_name((*points)[0]) == settings_name(MakeOptions()));
  CHECK((*points)[1].budget == 9000);
}

TEST_CASE("points that differ in the fit alone share a bake") {
  const MakeOptions a;
  CHECK(bake_name(a) ==
        bake_name(with_knobs(R"({"lobes": 1, "storage": "half", "layers": "products", "budget": 1000})")));
  CHECK(bake_name(a) != bake_name(with_knobs(R"({"samples": 2})")));
}

TEST_CASE("a grid that cannot be swept is refused with the knob as its place") {
  const auto refused = [](const char* text, const char* place, Code code = Code::option_out_of_range) {
    CAPTURE(text);
    const Error error = test::error_of(read_grid(text, "g.json"));
    CHECK(error.code == code);
    CHECK(error.file == "g.json");
    CHECK(error.place == place);
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
  refused(R"({"vary": {"layers": ["products"]}})", "");
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
