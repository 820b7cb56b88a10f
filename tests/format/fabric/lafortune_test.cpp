#include "format/fabric/lafortune.h"

#include <doctest/doctest.h>

#include <algorithm>
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

TEST_CASE(
    "in single precision the formula is as exact as its base, for exponents up to 10^4 and at 89.999 "
    "degrees") {
  constexpr long double degree = std::numbers::pi_v<long double> / 180;
  const auto direction = [&](long double polar, long double azimuth) {
    return std::array<float, 3>{static_cast<float>(std::sin(polar * degree) * std::cos(azimuth)),
                                static_cast<float>(std::sin(polar * degree) * std::sin(azimuth)),
                                static_cast<float>(std::cos(polar * degree))};
  };
  long double worst = 0;
  int bright = 0;
  for (const float n : {0.0F, 1e-3F, 1.0F, 20.0F, 200.0F, 1e3F, 1e4F}) {
    for (const std::array<float, 3>& c :
         {std::array{-1.0F, -1.0F, 1.0F}, {0.0F, 0.0F, 1.0F}, {-0.7F, -0.9F, 0.8F}}) {
      const std::array<float, 5> p{0.125F, c[0], c[1], c[2], n};
      const std::array<long double, 5> exact_p{p[0], p[1], p[2], p[3], p[4]};
      for (const long double from : {0.0L, 45.0L, 89.0L, 89.9L, 89.999L}) {
        for (const long double to : {0.0L, 45.0L, 89.0L, 89.9L, 89.999L}) {
          for (int turn = 0; turn < 8; ++turn) {
            const auto l = direction(from, 0), v = direction(to, turn * 45 * degree);
            const std::array<long double, 3> exact_l{l[0], l[1], l[2]}, exact_v{v[0], v[1], v[2]};
            long double base = 0, terms = 0;
            for (int i = 0; i < 3; ++i) {
              const long double term = exact_p[1 + i] * exact_l[i] * exact_v[i];
              base += term;
              terms += std::abs(term);
            }
            constexpr long double unit = 0x1p-24L;
            if (std::abs(base) < 8 * unit * terms) continue;  // rounding decides on which side of 0
            const long double exact = lafortune(exact_p.data(), 1, exact_l.data(), exact_v.data());
            const long double error = lafortune(p.data(), 1, l.data(), v.data()) - exact;
            // Four roundings of the base, which the exponent multiplies, and one each of power, sum and
            // cosine.
            const long double allowed = unit * exact * (base > 0 ? 4 * n * terms / base + 4 : 4);
            worst = std::max(worst, std::abs(error) / allowed);
            bright += exact > 0.2L * exact_l[2] ? 1 : 0;
          }
        }
      }
    }
  }
  CHECK(worst <= 1);
  CHECK(bright > 200);
  MESSAGE("largest error ", static_cast<double>(worst), " of the bound, ", bright, " bright");
}
