#include "converter/stitch/fibres.h"

#include <doctest/doctest.h>

using namespace selvedge;

TEST_CASE("a fibre's surface reflects what Fresnel's equations say, and passes light on to the front") {
  // Diffuse light on glass of index 1.5: 0.0918 (Duntley 1942, and tables since).
  CHECK(diffuse_fresnel_reflectance(1.5) == doctest::Approx(0.0918).epsilon(2e-3));
  CHECK(diffuse_fresnel_reflectance(1) == doctest::Approx(0));
  // A weak lens turns light by 2 (n - 1) tan(asin h): within 15 degrees nearly everywhere.
  CHECK(forward_transmitted_fraction(1.01) > 0.99);
  // Glass: asin h - asin(h / 1.5) = 7.5 degrees at h = 0.377, less two reflections of 0.04 each.
  CHECK(forward_transmitted_fraction(1.5) == doctest::Approx(0.377 * 0.96 * 0.96).epsilon(5e-3));
}
