#include "fitter/powers.h"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "format/random.h"

using namespace selvedge;

TEST_CASE("powers and logarithms agree with the C library's within their stated error") {
  Random random(1);
  std::vector<float> base;
  for (int i = 0; i < 10000; ++i) base.push_back(static_cast<float>(std::exp(30 * random.uniform() - 25)));
  for (int i = 0; i < 1000; ++i) base.push_back(static_cast<float>(1 + 1e-3 * (random.uniform() - 0.5)));
  std::vector<float> logarithm(base.size());
  std::vector<float> power(base.size());
  for (const float exponent : {0.0F, 1.0F, 2.5F, 17.0F, 200.0F}) {
    powers(base.data(), exponent, logarithm.data(), power.data(), base.size());
    for (std::size_t i = 0; i < base.size(); ++i) {
      const double log = std::log(static_cast<double>(base[i]));
      CHECK(std::abs(static_cast<double>(logarithm[i]) - log) <= 2e-7 * std::abs(log) + 1e-9);
      const double exact = std::exp(static_cast<double>(exponent) * log);
      if (exact < 1e-37 || exact > 1e38) continue;
      const double bound = 1e-6 + 4e-7 * static_cast<double>(exponent) * std::abs(log);
      CHECK(std::abs(static_cast<double>(power[i]) / exact - 1) <= bound);
    }
  }
}

TEST_CASE("a base that is not positive has power and logarithm 0") {
  const std::vector<float> base{0, -0.0F, -1, -1e30F, 1e-31F};
  std::vector<float> logarithm(base.size(), 7);
  std::vector<float> power(base.size(), 7);
  powers(base.data(), 0, logarithm.data(), power.data(), base.size());
  for (std::size_t i = 0; i < base.size(); ++i) {
    CHECK(power[i] == 0);
    CHECK(logarithm[i] == 0);
  }
}
