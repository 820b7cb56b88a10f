#include "viewer/light/reflections.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "tests/viewer/paths.h"

namespace selvedge {
namespace {

TEST_CASE("rough mirrors show the mean of an environment under their lobes, a small sun's included") {
  Environment e{128, 64, {}, {30, 2}};
  for (int y = 0; y < e.height; ++y) {
    for (int x = 0; x < e.width; ++x) {
      const V3d d = V3d(e.direction(x, y));
      e.radiance.push_back(d.dot(V3d(0.6, 0.64, 0.48)) > 0.995 ? V3f(300) : V3f(V3d(1 + d.y, 1, 1 - d.x)));
    }
  }
  const Reflections reflections = reflections_of(e);
  Random random(5, 0);
  for (const double roughness : {0.375, 0.5, 1.0}) {
    const double a2 = std::pow(roughness, 4);
    for (int i = 0; i < 20; ++i) {
      const V3d n = V3d(test::any_direction(random)).normalized();
      V3d sum(0, 0, 0);
      double weights = 0;
      for (int y = 0; y < e.height; ++y) {
        for (int x = 0; x < e.width; ++x) {
          const double nl = std::max(n.dot(e.direction(x, y)), 0.0);
          const double d = (1 + nl) / 2 * (a2 - 1) + 1;
          const double weight = nl / (d * d) * e.solid_angle(y);
          sum += V3d(e.radiance[y * e.width + x]) * weight;
          weights += weight;
        }
      }
      const V3d expected = sum / weights * e.options.strength;
      const V3f found = reflections.at(n, static_cast<float>(roughness));
      for (int c = 0; c < 3; ++c) CHECK(found[c] == doctest::Approx(expected[c]).epsilon(0.03));
    }
  }
}

}  // namespace
}  // namespace selvedge
