#include "converter/measured/scattered.h"

#include <doctest/doctest.h>

#include <array>
#include <cmath>

#include "format/fabric/lafortune.h"

namespace selvedge {
namespace {

enum class Function { lambert, gloss, bilinear };

double value_of(Function function, const DirectionPair& pair) {
  const V3d light(pair.light);
  const V3d view(pair.view);
  const std::array<double, 5> gloss{0.1, -0.8, -0.8, 0.9, 3};
  if (function == Function::gloss) return lafortune(gloss.data(), 1, &light.x, &view.x);
  return function == Function::lambert ? light.z : (1 + light.x - light.y) * (2 + view.z);
}

PairValues known_at(Function function, const std::vector<DirectionPair>& pairs) {
  PairValues known{pairs, {}};
  known.values.resize(static_cast<Eigen::Index>(pairs.size()), 1);
  for (std::size_t i = 0; i < pairs.size(); ++i)
    known.values(static_cast<Eigen::Index>(i), 0) = static_cast<float>(value_of(function, pairs[i]));
  return known;
}

/// Relative root mean square error at other pairs.
double error_of(Function function, const PairValues& known, const std::vector<DirectionPair>& pairs) {
  const Eigen::MatrixXf found = interpolate(known, choose_covariance(known, 1), pairs);
  double error = 0;
  double energy = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const double truth = value_of(function, pairs[i]);
    error += std::pow(static_cast<double>(found(static_cast<Eigen::Index>(i), 0)) - truth, 2);
    energy += truth * truth;
  }
  return std::sqrt(error / energy);
}

TEST_CASE("functions of light and view are recovered from 400 scattered pairs") {
  const auto error = [](Function function) {
    return error_of(function, known_at(function, random_direction_pairs(400, 0.15, 11)),
                    random_direction_pairs(200, 0.15, 12));
  };
  CHECK(error(Function::lambert) < 0.005);
  CHECK(error(Function::bilinear) < 0.005);
  CHECK(error(Function::gloss) < 0.1);
}

TEST_CASE("the left-out error is the error of interpolation without each pair") {
  const PairValues known = known_at(Function::gloss, random_direction_pairs(25, 0.15, 13));
  const PairCovariance kernel = choose_covariance(known, 1);
  double error = 0;
  for (std::size_t i = 0; i < known.pairs.size(); ++i) {
    PairValues others{{}, {}};
    others.values.resize(24, 1);
    for (std::size_t j = 0; j < known.pairs.size(); ++j) {
      if (j == i) continue;
      others.values(static_cast<Eigen::Index>(others.pairs.size()), 0) =
          known.values(static_cast<Eigen::Index>(j), 0);
      others.pairs.push_back(known.pairs[j]);
    }
    const float found = interpolate(others, kernel, {&known.pairs[i], 1})(0, 0);
    error += std::pow(1.0 * found - 1.0 * known.values(static_cast<Eigen::Index>(i), 0), 2);
  }
  const double expected = std::sqrt(error) / known.values.cast<double>().norm();
  CHECK(kernel.leave_one_out_error == doctest::Approx(expected).epsilon(1e-4));
}

}  // namespace
}  // namespace selvedge
