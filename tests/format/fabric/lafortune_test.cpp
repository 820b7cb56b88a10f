#include "format/fabric/lafortune.h"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <numbers>

using namespace selvedge;

TEST_CASE("a lobe with C = (-1, -1, 1) is Phong's: its base is the cosine to the mirrored light") {
  const std::array<double, 5> p{0, -1, -1, 1, 20};
  const std::array<double, 3> l{0.6, 0, 0.8};
  const std::array<double, 3> mirrored{-0.6, 0, 0.8};
  CHECK(lafortune(p.data(), 1, l.data(), mirrored.data()) == doctest::Approx(0.8));
  const std::array<double, 3> v{0, 0, 1};
  CHECK(lafortune(p.data(), 1, l.data(), v.data()) == doctest::Approx(0.8 * std::pow(0.8, 20)));
}

TEST_CASE("the formula's edges are as stated") {
  const std::array<double, 3> up{0, 0, 1};
  const std::array<double, 3> below{0, 0.6, -0.8};
  const std::array<double, 3> level{1, 0, 0};
  const std::array<double, 5> exponent_zero{0, 0, 0, 1, 0};
  const std::array<double, 5> negative_base{0, 0, 0, -1, 2};
  CHECK(lafortune(exponent_zero.data(), 1, up.data(), up.data()) == 1);
  CHECK(lafortune(negative_base.data(), 1, up.data(), up.data()) == 0);
  CHECK(lafortune(exponent_zero.data(), 1, below.data(), up.data()) == 0);
  CHECK(lafortune(exponent_zero.data(), 1, level.data(), up.data()) == 0);
}
