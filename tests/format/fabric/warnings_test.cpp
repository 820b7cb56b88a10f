#include "format/fabric/warnings.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "format/base/random.h"
#include "tests/format/fabrics.h"

using namespace selvedge;

namespace {

/// Tables of one direction, to evaluate a level with.
Fabric one_view() {
  Fabric fabric;
  fabric.views = {1, 1};
  return fabric;
}

Issues warnings_of(const FabricLevel& level, bool half = false) {
  IssueSink sink("fabric");
  warn_of_peaks(level, Side::front, 0, half, sink);
  const FabricInfo info = one_view();
  warn_of_energy({&level, &info}, {}, 0, sink);
  return sink.take();
}

/// One texel, the same in all channels: rho, and one lobe with the parameters C = (-c, -c, c) and n.
FabricLevel phong(float rho, float c, float n) {
  FabricLevel level;
  level.width = 1;
  level.height = 1;
  level.set(LayerKind::lobes, {15, {rho, -c, -c, c, n, rho, -c, -c, c, n, rho, -c, -c, c, n}});
  return level;
}

}  // namespace

TEST_CASE("no pair of directions exceeds the peak of a lobe, and some come near") {
  Random random(11);
  for (int trial = 0; trial < 20; ++trial) {
    std::array<float, 4> lobe{};
    for (std::size_t i = 0; i < 3; ++i) lobe[i] = test::uniform(random, -1.2, 1.2);
    lobe[3] = test::uniform(random, 0.5, 3);
    const double peak = lobe_peak(lobe.data());
    double largest = 0;
    for (const DirectionPair& pair : random_pairs(20000, 0, static_cast<std::uint64_t>(trial))) {
      const double base =
          static_cast<double>(lobe[0] * pair.light.x * pair.view.x + lobe[1] * pair.light.y * pair.view.y +
                              lobe[2] * pair.light.z * pair.view.z);
      if (base > 0) largest = std::max(largest, std::pow(base, static_cast<double>(lobe[3])));
    }
    CHECK(largest <= peak * (1 + 1e-5));  // single precision
    CHECK(largest >= peak * 0.8);         // of 20,000 pairs one is near enough
  }
}

TEST_CASE("a lobe past half precision is a warning") {
  // 2^16 = 65,536 is the first power of two beyond 65,504. So strong a lobe breaks the energy balance, too.
  const Issues issues = warnings_of(phong(0, 2, 16));
  REQUIRE(issues.size() >= 1);
  CHECK(issues[0].code == Code::fabric_peak);
  CHECK(issues[0].place == "lobes/level 0/lobes.0.n.red/0,0");
  for (const Error& issue : warnings_of(phong(0, 2, 15.99F))) CHECK(issue.code != Code::fabric_peak);
  CHECK(warnings_of(phong(0.1F, 0.5F, 3000)).empty());
}

TEST_CASE("half precision moves the peak of a lobe by as much as the bound says") {
  // Largest relative error of rounding C in [1, 2) to 11 bits: half a unit in the last place.
  const float c = 1.0F + 0.5F / 1024 - 1e-6F;
  const double peak = std::pow(static_cast<double>(c), static_cast<double>(max_half_exponent));
  CHECK(peak == doctest::Approx(1.05).epsilon(0.002));  // the rounded C is 1, its peak 1
  CHECK(warnings_of(phong(0.1F, 0.5F, 102), true).empty());
  const Issues issues = warnings_of(phong(0.1F, 0.5F, 103), true);
  REQUIRE(issues.size() == 1);
  CHECK(issues[0].code == Code::fabric_peak);
  CHECK(warnings_of(phong(0.1F, 0.5F, 103), false).empty());
}

TEST_CASE("a white Lambert texel sends out what it receives, a whiter one more") {
  CHECK(warnings_of(test::lambert_fabric(1, 1, {1, 1, 1}).levels[0]).empty());
  const Issues issues = warnings_of(test::lambert_fabric(1, 1, {0.5F, 1.03F, 0.5F}).levels[0]);
  REQUIRE(issues.size() == 2);
  CHECK(issues[0].code == Code::fabric_energy);
  CHECK(issues[0].place == "level 0/green/0,0");
  CHECK(issues[0].message == "sends out 1.03 times what a surface that faces the light receives");
  CHECK(issues[1].place == "level 0/green");
  CHECK(issues[1].message == "the cloth sends out 1.03 times the light that falls on it");
}

TEST_CASE("the energy of a mirror lobe is the closed form for small and large exponents") {
  // C = (-1, -1, 1) is Phong's lobe about the mirrored light; for light along the normal
  // integral of cos^n cos = 2 pi / (n + 2). A lobe of s times that has s in C as s^(1/n).
  for (const float n : {0.0F, 1.0F, 10.0F, 100.0F, 1000.0F, 10000.0F}) {
    CAPTURE(n);
    const auto lobe_of = [&](double energy) {
      const double scale = energy * (static_cast<double>(n) + 2) / (2 * 3.14159265358979);
      // With n = 0 the lobe is 1 whatever C is: rho takes the rest.
      return n > 0 ? phong(0, static_cast<float>(std::pow(scale, 1 / static_cast<double>(n))), n)
                   : phong(static_cast<float>(scale - 1), 1, 0);
    };
    const auto names_energy = [](const Issues& issues) {
      return std::any_of(issues.begin(), issues.end(), [](const Error& issue) {
        return issue.code == Code::fabric_energy && issue.place == "level 0/red/0,0";
      });
    };
    if (n > 0) CHECK_FALSE(names_energy(warnings_of(lobe_of(0.99))));
    CHECK(names_energy(warnings_of(lobe_of(1.03))));
  }
}
