#include "format/simd/powers.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
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

/// The same with the fast power.
template <std::size_t Count>
std::vector<float> fast_powers(const std::vector<float>& base, float exponent) {
  using L = Lanes<Count>;
  std::vector<float> power;
  for (std::size_t i = 0; i < base.size(); i += Count) {
    std::array<float, Count> in{};
    std::copy_n(base.begin() + static_cast<std::ptrdiff_t>(i), std::min(Count, base.size() - i), in.begin());
    typename L::Floats b;
    L::load(in.data(), b);
    typename L::Floats result;
    L::fast_power(b, typename L::Floats{} + exponent, result);
    L::store(result, in.data());
    power.insert(power.end(), in.begin(), in.end());
  }
  power.resize(base.size());
  return power;
}

}  // namespace

TEST_CASE("powers and logarithms agree with the C library's within their stated error") {
  Random random(1);
  std::vector<float> base;
  for (int i = 0; i < 10000; ++i) base.push_back(static_cast<float>(std::exp(30 * random.uniform() - 25)));
  for (int i = 0; i < 1000; ++i) base.push_back(static_cast<float>(1 + 1e-3 * (random.uniform() - 0.5)));
  std::vector<float> logarithm(base.size());
  std::vector<float> power(base.size());
  for (const float exponent : {0.0F, 1.0F, 2.5F, 17.0F, 200.0F}) {
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

TEST_CASE(
    "fast powers agree with the C library's within their stated error, for exponents into the thousands") {
  Random random(3);
  std::vector<float> base;
  const double octaves = std::log(2e6);
  for (int i = 0; i < 20000; ++i)
    base.push_back(static_cast<float>(1e-6 * std::exp(octaves * random.uniform())));
  for (int i = 0; i < 2000; ++i) base.push_back(static_cast<float>(1 + 1e-2 * (random.uniform() - 0.5)));
  // Where one piece of the logarithm ends.
  for (const float root : {0.70710678F, 1.41421356F}) {
    base.insert(base.end(), {root, std::nextafter(root, 0.0F), std::nextafter(root, 2.0F)});
  }
  int compared = 0;
  for (const float exponent : {0.0F, 0.3F, 1.0F, 2.5F, 17.0F, 200.0F, 1000.0F, 5000.0F}) {
    const std::vector<float> power = fast_powers<8>(base, exponent);
    for (std::size_t i = 0; i < base.size(); ++i) {
      const double exact = std::pow(static_cast<double>(base[i]), static_cast<double>(exponent));
      if (exact < 1e-37 || exact > 1e38) continue;
      const double bound =
          8e-5 + 6e-5 * static_cast<double>(exponent) * std::abs(std::log(static_cast<double>(base[i])));
      CHECK(std::abs(static_cast<double>(power[i]) / exact - 1) <= bound);
      ++compared;
    }
  }
  CHECK(compared > 90000);
}

TEST_CASE(
    "fast powers are finite whatever the base, 0 where it is not above 1e-30, and their ends are held") {
  const float most = std::numeric_limits<float>::max();
  const std::vector<float> base{0, -0.0F, -1, -most, 1e-31F, 1e-40F, std::nanf(""), most, 2, 1e-20F};
  for (const float exponent : {0.0F, 1.0F, 3000.0F, most}) {
    const std::vector<float> power = fast_powers<4>(base, exponent);
    for (std::size_t i = 0; i < 7; ++i) CHECK(power[i] == 0);
    for (const float of : power) CHECK((of >= 0 && of <= most));
  }
  const std::vector<float> power = fast_powers<4>(base, 3000);
  CHECK(power[7] == doctest::Approx(std::exp2(127.0)).epsilon(1e-4));
  CHECK(power[9] == doctest::Approx(std::exp2(-126.0)).epsilon(1e-4));
}

TEST_CASE("fast powers have the same bits in vectors of 4, 8 and 16 numbers") {
  Random random(4);
  std::vector<float> base;
  for (int i = 0; i < 4096; ++i) base.push_back(static_cast<float>(4 * random.uniform() - 1));
  for (const float exponent : {0.7F, 7.3F, 900.0F}) {
    const std::vector<float> four = fast_powers<4>(base, exponent);
    CHECK(four == fast_powers<8>(base, exponent));
    CHECK(four == fast_powers<16>(base, exponent));
  }
}
