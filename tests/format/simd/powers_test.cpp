#include "format/simd/powers.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "format/base/random.h"

using namespace selvedge;

namespace {

/// The header's powers, over an array and with any width of vector: x^n is e^(n ln x), 0 where x is not
/// above 1e-30.
template <std::size_t Count>
void powers(const float* base, float exponent, float* logarithm, float* power, std::size_t size) {
  using L = Lanes<Count>;
  for (std::size_t i = 0; i < size; i += Count) {
    std::array<float, Count> in{};
    const std::size_t count = std::min(Count, size - i);
    std::copy_n(base + i, count, in.begin());
    typename L::Floats b;
    L::load(in.data(), b);
    typename L::Floats log;
    typename L::Floats result;
    L::log_and_power(b, exponent, log, result);
    L::store(log, in.data());
    std::copy_n(in.begin(), count, logarithm + i);
    L::store(result, in.data());
    std::copy_n(in.begin(), count, power + i);
  }
}

}  // namespace

TEST_CASE("powers and logarithms agree with the C library's within their stated error") {
  Random random(1);
  std::vector<float> base;
  for (int i = 0; i < 10000; ++i) base.push_back(static_cast<float>(std::exp(30 * random.uniform() - 25)));
  for (int i = 0; i < 1000; ++i) base.push_back(static_cast<float>(1 + 1e-3 * (random.uniform() - 0.5)));
  std::vector<float> logarithm(base.size());
  std::vector<float> power(base.size());
  for (const float exponent : {0.0F, 1.0F, 2.5F, 17.0F, 200.0F, 1e4F}) {
    powers<8>(base.data(), exponent, logarithm.data(), power.data(), base.size());
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
  powers<4>(base.data(), 0, logarithm.data(), power.data(), base.size());
  for (std::size_t i = 0; i < base.size(); ++i) {
    CHECK(power[i] == 0);
    CHECK(logarithm[i] == 0);
  }
}

TEST_CASE("vectors of 4, 8 and 16 numbers give the same bits") {
  Random random(2);
  std::vector<float> base;
  for (int i = 0; i < 4096; ++i) base.push_back(static_cast<float>(4 * random.uniform() - 1));
  std::array<std::vector<float>, 6> results;
  for (auto& result : results) result.resize(base.size());
  powers<4>(base.data(), 7.3F, results[0].data(), results[1].data(), base.size());
  powers<8>(base.data(), 7.3F, results[2].data(), results[3].data(), base.size());
  powers<16>(base.data(), 7.3F, results[4].data(), results[5].data(), base.size());
  CHECK(results[0] == results[2]);
  CHECK(results[0] == results[4]);
  CHECK(results[1] == results[3]);
  CHECK(results[1] == results[5]);
}
