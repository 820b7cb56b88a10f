#include "converter/stitch_library.h"

#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>

#include "converter/implicit_surface.h"
#include "converter/stitch_json.h"
#include "format/atomic_file.h"

using namespace selvedge;

TEST_CASE("every built-in stitch is found by its name and valid") {
  for (const StitchInfo& info : built_in_stitches()) {
    const auto pattern = find_stitch(info.name);
    REQUIRE(pattern);
    CHECK(pattern->name == info.name);
    CHECK(validate(*pattern, info.name));
    CHECK_FALSE(info.description.empty());
    CHECK(info.description.find('\n') == std::string::npos);
  }
}

TEST_CASE("yarns of the built-in stitches touch, and overlap by less than a tenth of their diameter") {
  for (const StitchInfo& info : built_in_stitches()) {
    const auto pattern = find_stitch(info.name);
    const auto clearance = minimum_clearance(*pattern, "");
    REQUIRE(clearance);
    const double diameter = 2 * pattern->yarns[0].radius_mm;
    MESSAGE(info.name, ": clearance ", *clearance, " mm, ", 100 * *clearance / diameter,
            " % of the diameter");
    CHECK(*clearance < 0.02 * diameter);
    CHECK(*clearance > -0.1 * diameter);
  }
}

TEST_CASE("chains are smooth: each segment leaves in the direction in which the one before arrived") {
  for (const StitchInfo& info : built_in_stitches()) {
    const auto pattern = find_stitch(info.name);
    REQUIRE(pattern);
    for (const Yarn& yarn : pattern->yarns) {
      for (std::size_t s = 0; s < yarn.segments.size(); ++s) {
        const BezierSegment& before = yarn.segments[s];
        const BezierSegment& after = yarn.segments[(s + 1) % yarn.segments.size()];
        const V3d arrival = derivative_at(before, 1).normalized();
        CHECK((arrival - derivative_at(after, 0).normalized()).length() < 1e-12);
      }
    }
  }
}

TEST_CASE(
    "a loop of plain knit has its legs in front, head and foot behind, and turns half a stitch into itself") {
  const PlainKnitOptions options;
  const StitchPattern knit = plain_knit(options);
  const auto& loop = knit.yarns[0].segments;
  REQUIRE(loop.size() == 16);
  CHECK(loop[0][0].z < 0);   // foot
  CHECK(loop[4][0].z > 0);   // left leg
  CHECK(loop[8][0].z < 0);   // head
  CHECK(loop[12][0].z > 0);  // right leg
  CHECK(loop[8][0].y > loop[4][0].y);
  // A V: the left leg leans outwards on its way up.
  CHECK(loop[5][0].x < loop[3][0].x);
  // The head reaches over the foot of the loop above: they interlock.
  CHECK(loop[8][0].y > loop[0][0].y + options.course_mm + 2 * options.radius_mm);
  for (std::size_t s = 0; s < 8; ++s) {  // glide symmetry of the plain knit
    const V3d turned = loop[s + 8][0] - loop[s][0];
    CHECK(turned.x == doctest::Approx(options.wale_mm / 2));
    CHECK(loop[s + 8][0].y == doctest::Approx(-loop[s][0].y));
    CHECK(loop[s + 8][0].z == doctest::Approx(loop[s][0].z));
  }
}

TEST_CASE("plain weave goes over and under by turns") {
  const PlainWeaveOptions options;
  const StitchPattern weave = plain_weave(options);
  REQUIRE(weave.yarns.size() == 4);
  const auto height_at = [&](std::size_t yarn, std::size_t crossing) {
    return weave.yarns[yarn].segments[crossing == 0 ? 2 : 6][0].z;  // a quarter and three quarters along
  };
  for (std::size_t warp = 0; warp < 2; ++warp) {
    for (std::size_t weft = 0; weft < 2; ++weft) {
      const double gap = height_at(2 * warp, weft) - height_at(2 * weft + 1, warp);
      CHECK((gap > 0) == (warp == weft));
      CHECK(std::abs(gap) == doctest::Approx(options.warp_radius_mm + options.weft_radius_mm));
    }
  }
}

TEST_CASE("a stitch description on disk is found by its path") {
  const auto path = std::filesystem::temp_directory_path() / "selvedge_found_stitch.json";
  StitchPattern pattern = plain_weave();
  pattern.name = "mine";
  REQUIRE(write_file(path.string(), to_json(pattern)));
  const auto found = find_stitch(path.string());
  std::filesystem::remove(path);
  REQUIRE(found);
  CHECK(found->name == "mine");
}

TEST_CASE("an unknown name is refused with the names that exist") {
  const auto unknown = find_stitch("cable");
  REQUIRE_FALSE(unknown);
  CHECK(
      to_line(unknown.error()) ==
      "cable: no such file and no such built-in stitch (there are plain-knit, plain-weave) [STITCH_UNKNOWN]");
}
