#include "converter/stitch/fibres.h"

#include <doctest/doctest.h>

#include <cmath>

#include "converter/stitch/library.h"
#include "tests/require.h"

using namespace selvedge;

TEST_CASE("a fibre's surface reflects what Fresnel's equations say, and passes light on to the front") {
  // Diffuse light on glass of index 1.5: 0.0918 (Duntley 1942, and tables since).
  CHECK(surface_reflectance(1.5) == doctest::Approx(0.0918).epsilon(2e-3));
  CHECK(surface_reflectance(1) == doctest::Approx(0));
  // A weak lens turns light by 2 (n - 1) tan(asin h): within 15 degrees nearly everywhere.
  CHECK(forward_share(1.01) > 0.99);
  // Glass: asin h - asin(h / 1.5) = 7.5 degrees at h = 0.377, less two reflections of 0.04 each.
  CHECK(forward_share(1.5) == doctest::Approx(0.377 * 0.96 * 0.96).epsilon(5e-3));
}

TEST_CASE("a kind of yarn fits every stitch that it is named for") {
  for (int kind = 1; kind < static_cast<int>(yarn_kinds().size()); ++kind) {
    const YarnKind& k = yarn_kinds()[kind];
    CAPTURE(k.name);
    for (const char* stitch : {"plain-knit", "satin"}) {
      const bool woven = stitch == std::string("satin");
      const Yarn yarn = test::need(find_stitch(stitch, {{"yarn", {1.0 * kind}}})).pattern.yarns[0];
      CHECK(yarn.fibre == kind);
      CHECK(yarn.plies == (woven ? 1 : k.plies));
      // Lean at the surface of the yarn: the radius times the angle a mm.
      const double slope = 2 * std::acos(-1.0) * yarn.radius_mm * yarn.twist_per_mm;
      CHECK(std::atan(slope) * 180 / std::acos(-1.0) ==
            doctest::Approx(woven ? k.fibre_degrees : k.twist_degrees).epsilon(0.02));
      CHECK(yarn.fibre_degrees == (woven ? 0 : k.fibre_degrees));
      CHECK(3 * yarn.hair_mm <= (woven ? 2.5 : 3.8));
      CHECK(static_cast<double>(yarn.gloss.weight) == doctest::Approx(surface_reflectance(k.refraction)));
    }
  }
}
