#include "converter/make/pack_yarn.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "format/fabric/directions.h"

namespace selvedge {
namespace {

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using FloatMatrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Makes numbers of a station's values whose squares add up to the mean square of its radiance over angles
/// and lights: the functions of the light are far from perpendicular. Upper triangular.
Matrix mean_square_factor(double moment_weight) {
  constexpr int count = yarn_light_function_count;
  Matrix products = Matrix::Zero(count, count);
  const DirectionGrid lights{16, 16};
  for (int l = 0; l < lights.count(); ++l) {
    const auto basis = light_basis(cell_direction(lights, l));
    for (int i = 0; i < count; ++i)
      for (int k = 0; k < count; ++k)
        products(i, k) += static_cast<double>(basis[i]) * static_cast<double>(basis[k]) / lights.count();
  }
  const Matrix upper = products.llt().matrixU();
  Matrix root = Matrix::Identity(light_values_per_station, light_values_per_station) * moment_weight;
  root.topLeftCorner(transfer_values_per_station, transfer_values_per_station).setZero();
  for (int list = 0; list < 3 * angle_function_count; ++list) {
    const int angle = list / 3;
    // Mean squares of 1, cosines and sines.
    const double size = angle == 0 ? 1 : std::sqrt(0.5);
    for (int i = 0; i < count; ++i)
      for (int k = i; k < count; ++k)
        root(3 * (angle * count + i) + list % 3, 3 * (angle * count + k) + list % 3) = size * upper(i, k);
  }
  return root;
}

/// To 8 bits, which pack well.
float rounded(double value) {
  int power = 0;
  const double mantissa = std::frexp(value, &power);
  return static_cast<float>(std::ldexp(std::round(256 * mantissa), power - 8));
}

/// Sets functions and factors; whether these are small enough.
bool pack_light(const YarnData& yarn, YarnPacking& packing) {
  constexpr double step_of_mean = 0.1;  ///< of factors, in square roots of the mean square of the radiance
  constexpr double min_mean_square = 0.125;  ///< of factors in steps: functions below add less than rounding
  constexpr double max_factor = 2048;        ///< that a 16-bit float holds
  constexpr double moment_of_mean = 0.25;
  constexpr int values = light_values_per_station;
  const auto given = [](const std::vector<float>& light) {
    return Eigen::Map<const FloatMatrix>(light.data(), static_cast<Eigen::Index>(light.size() / values),
                                         values);
  };
  // Blocks of stations: all in double precision would take twice the memory of the rest.
  constexpr Eigen::Index at_once = 4096;
  const auto for_each_block = [&](const std::vector<float>& light, const auto& visit) {
    const auto all = given(light);
    for (Eigen::Index first = 0; first < all.rows(); first += at_once)
      visit(first, Matrix(all.middleRows(first, std::min(at_once, all.rows() - first)).cast<double>()));
  };
  Matrix squares = Matrix::Zero(values, values);
  double stations = 0;
  for (const auto* light : {&yarn.station_light, &yarn.light_through}) {
    for_each_block(*light, [&](Eigen::Index, const Matrix& some) {
      squares += some.transpose() * some;
      stations += static_cast<double>(some.rows());
    });
  }
  const Matrix plain = mean_square_factor(0);
  const double mean = std::sqrt((plain * squares * plain.transpose()).trace() / stations);
  if (!(mean > 0)) return false;
  const Matrix root = mean_square_factor(moment_of_mean * mean);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> found(root * squares * root.transpose());
  const double step = step_of_mean * mean;
  const double enough = min_mean_square * step * step * stations;
  const auto functions = (found.eigenvalues().array() > enough).count();
  const Matrix directions = found.eigenvectors().rightCols(functions).rowwise().reverse();
  // A function is a step along a direction.
  const Matrix steps = (root.triangularView<Eigen::Upper>().solve(directions) * step).transpose();
  for (const double value : steps.reshaped<Eigen::RowMajor>()) packing.functions.push_back(rounded(value));
  for (const auto& [light, factors] : {std::pair(&yarn.station_light, &packing.factors),
                                       std::pair(&yarn.light_through, &packing.factors_through)}) {
    Matrix wanted(functions, given(*light).rows());
    for_each_block(*light, [&, to_factors = Matrix(directions.transpose() * root / step)](
                               Eigen::Index first, const Matrix& some) {
      wanted.middleCols(first, some.rows()) = to_factors * some.transpose();
    });
    for (const double value : wanted.reshaped<Eigen::RowMajor>()) {
      if (!(std::abs(value) < max_factor)) return false;
      factors->push_back(static_cast<float>(std::round(value)));
    }
  }
  return true;
}

V3f on_grid(const V3f& v, float step) {
  return V3f(std::round(v.x / step), std::round(v.y / step), std::round(v.z / step)) * step;
}

/// To whole steps, of like signs along the curve: g and -g are the same section.
void round_squeezes(std::vector<V3f>& squeezes) {
  for (std::size_t i = 0; i < squeezes.size(); ++i) {
    V3f& own = squeezes[i];
    if (i > 0 && own.dot(squeezes[i - 1]) < 0) own = -own;
    own = on_grid(own, packed_squeeze_step);
    // Less than the largest that validate() takes.
    while (own.length2() > 1 - min_flattening) own = on_grid(own * 0.96F, packed_squeeze_step);
  }
}

}  // namespace

YarnData packed_if_large(YarnData yarn) {
  constexpr std::size_t many_stations = 1024;
  constexpr float steps_per_radius = 64;
  if (yarn.station_light.size() <= many_stations * light_values_per_station) return yarn;
  YarnPacking packing;
  if (!pack_light(yarn, packing)) return yarn;
  float radius = std::numeric_limits<float>::infinity();
  for (const YarnCurve& curve : yarn.curves) radius = std::min(radius, ply_or_yarn_radius(curve));
  packing.step = std::exp2(std::floor(std::log2(radius / steps_per_radius)));
  for (V3f& node : yarn.nodes) node = on_grid(node, packing.step);
  for (YarnCurve& curve : yarn.curves) round_squeezes(curve.squeezes);
  yarn.station_light = unpacked_light(packing, packing.factors);
  if (!yarn.light_through.empty()) yarn.light_through = unpacked_light(packing, packing.factors_through);
  yarn.packing = std::move(packing);
  return yarn;
}

}  // namespace selvedge
