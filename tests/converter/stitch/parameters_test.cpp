#include "converter/stitch/parameters.h"

#include <doctest/doctest.h>

using namespace selvedge;

TEST_CASE("settings are read from name=value") {
  StitchSettings settings;
  CHECK(parse_setting("wale_mm=2.5", settings));
  CHECK(parse_setting("albedo=0.1,0.2,0.3", settings));
  CHECK(settings["wale_mm"] == std::vector<double>{2.5});
  CHECK(settings["albedo"] == std::vector<double>{0.1, 0.2, 0.3});
  CHECK(parse_setting("colour=#ff8000", settings));
  CHECK(settings["colour"][0] == 1);
  CHECK(settings["colour"][1] == doctest::Approx(0.21586).epsilon(1e-4));  // sRGB's 128
  CHECK(settings["colour"][2] == 0);
  CHECK(parse_setting("warp_yarn=wool", settings));
  CHECK(settings["warp_yarn"] == std::vector<double>{2});
  for (const char* bad : {"colour=#ff800", "colour=#ff80zz", "colour=#-1-1-1", "yarn=wolo", "yarn=", "", "=",
                          "=1", "wale_mm", "wale_mm=", "wale_mm=x", "wale_mm=1,2,3,4", "wale_mm=nan"}) {
    CAPTURE(bad);
    CHECK_FALSE(parse_setting(bad, settings));
  }
}

TEST_CASE("settings are refused with the name, the range and the names that exist") {
  const std::vector<StitchParameter> parameters{{"a", {1}, 0, 2, ""}, {"b", {1}, 0, 9, "", true}};
  const auto line = [&](const StitchSettings& settings) {
    const auto values = StitchValues::create("s", parameters, settings);
    return values ? "accepted" : to_line(values.error());
  };
  CHECK(line({{"c", {1}}}) == "s: --set c: no such parameter (there are a, b) [OPTION_OUT_OF_RANGE]");
  CHECK(line({{"a", {3}}}) == "s: --set a: must lie in 0 to 2, is 3 [OPTION_OUT_OF_RANGE]");
  CHECK(line({{"a", {1, 1, 1}}}) == "s: --set a: takes 1 numbers, not 3 [OPTION_OUT_OF_RANGE]");
  CHECK(line({{"b", {1.5}}}) == "s: --set b: must be a whole number, is 1.5 [OPTION_OUT_OF_RANGE]");
}
