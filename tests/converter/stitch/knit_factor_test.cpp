#include "converter/stitch/knit_factor.h"

#include <doctest/doctest.h>

#include <Eigen/Cholesky>
#include <random>
#include <tuple>
#include <vector>

namespace selvedge {

TEST_CASE("blocks of a Cholesky factor solve as Eigen does") {
  constexpr std::uint32_t points = 60;
  std::mt19937 random(1);
  const auto vector = [&] {
    std::uniform_real_distribution<float> values(-1, 1);
    return Eigen::Vector3f(values(random), values(random), values(random));
  };
  BlockMatrix blocks(points);
  Eigen::MatrixXd dense = 0.1 * Eigen::MatrixXd::Identity(3 * points, 3 * points);
  for (std::uint32_t i = 0; i < points; ++i) blocks.at(i, i) += 0.1F * Eigen::Matrix3f::Identity();
  // Springs between neighbours of a ring and between others, stiff along their ways alone.
  for (std::uint32_t k = 0; k < 4 * points; ++k) {
    const std::uint32_t i = k % points;
    const std::uint32_t j = k < points ? (i + 1) % points : static_cast<std::uint32_t>(random() % points);
    if (i == j) continue;
    const Eigen::Vector3f way = vector();
    const Eigen::Matrix3f square = way * way.transpose();
    blocks.at(i, i) += square;
    blocks.at(j, j) += square;
    blocks.at(i, j) -= square;
    for (const auto& [row, column, sign] : {std::tuple(i, i, 1), {j, j, 1}, {i, j, -1}, {j, i, -1}})
      dense.block<3, 3>(3 * row, 3 * column) += sign * square.cast<double>();
  }
  std::vector<Eigen::Vector3f> x(points);
  Eigen::VectorXd right(3 * points);
  for (std::uint32_t i = 0; i < points; ++i) {
    x[i] = vector();
    right.segment<3>(3 * i) = x[i].cast<double>();
  }
  const Eigen::VectorXd expected = dense.ldlt().solve(right);
  BlockCholesky(blocks).solve(x);
  for (std::uint32_t i = 0; i < points; ++i)
    CHECK((x[i].cast<double>() - expected.segment<3>(3 * i)).norm() < 1e-4 * expected.norm());
}

}  // namespace selvedge
