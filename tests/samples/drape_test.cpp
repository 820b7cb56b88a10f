#include "samples/drape.h"

#include <doctest/doctest.h>

namespace selvedge::samples {
namespace {

double nowhere(const V3d&) { return 1; }

TEST_CASE("a chain hangs straight down from the point that is held") {
  Cloth chain;
  for (int i = 0; i < 6; ++i) {
    chain.positions.emplace_back(0.1 * i, 0, 0);
    chain.held.push_back(i == 0);
    if (i > 0) chain.threads.push_back({i - 1, i, 0.1, 0});
  }
  DrapeOptions options;
  options.steps = 20000;
  const std::vector<V3d> hanging = drape(chain, nowhere, options);
  CHECK(hanging[0] == V3d(0, 0, 0));
  for (std::size_t i = 1; i < 6; ++i) {
    // 22 s at a drag of 2 / s: the swing is gone. Threads that do not give keep their length to a millimetre.
    CHECK(hanging[i].x == doctest::Approx(0).epsilon(0.001));
    CHECK(hanging[i].y == doctest::Approx(-0.1 * static_cast<double>(i)).epsilon(0.01));
  }
}

TEST_CASE("what falls on a body comes to rest on it, the margin above") {
  Cloth point;
  point.positions.emplace_back(0.0, 0.1, 0.0);
  point.held.push_back(false);
  DrapeOptions options;
  options.steps = 5000;
  const std::vector<V3d> fallen = drape(
      point, [](const V3d& p) { return p.y; }, options);
  CHECK(fallen[0].y == doctest::Approx(options.margin).epsilon(0.01));
}

TEST_CASE("smoothing leaves held points and straight rows where they are") {
  Cloth row;
  for (int i = 0; i < 9; ++i) {
    row.positions.emplace_back(i, i == 4 ? 1 : 0, 0);
    row.held.push_back(i == 0 || i == 8);
    if (i > 0) row.threads.push_back({i - 1, i, 1, 0});
  }
  const std::vector<V3d> smoothed = smooth(row, 1, 0);
  CHECK(smoothed[0] == row.positions[0]);
  CHECK(smoothed[8] == row.positions[8]);
  CHECK(smoothed[2].y == 0);
  CHECK(smoothed[4].y == doctest::Approx(0.5));
  CHECK(smoothed[3].y == doctest::Approx(0.25));
}

}  // namespace
}  // namespace selvedge::samples
