#include "fitter/lobes/lobe_step.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

namespace selvedge {

std::size_t longest_component(const LobeShape& shape) {
  std::size_t at = 0;
  for (std::size_t k = 1; k < 3; ++k)
    if (std::abs(shape.direction[k]) > std::abs(shape.direction[at])) at = k;
  return at;
}

void move_lobe(const LobeStep& step, const LobeBounds& bounds, LobeShape& shape, double& size) {
  constexpr double max_log_step = 1.5;
  const std::size_t kept = longest_component(shape);
  shape.direction[(kept + 1) % 3] += step.direction[0];
  shape.direction[(kept + 2) % 3] += step.direction[1];
  shape.exponent =
      std::clamp(shape.exponent * std::exp(std::clamp(step.log_exponent, -max_log_step, max_log_step)),
                 bounds.min_exponent, bounds.max_exponent);
  const double length = std::abs(shape.direction[longest_component(shape)]);
  for (double& d : shape.direction) d /= length;
  size = std::clamp((size + step.size) * std::pow(length, shape.exponent), 0.0, bounds.max_size);
}

bool is_at_bound(std::size_t unknown, double gradient, const LobeBounds& bounds, const LobeShape& shape,
                 double size) {
  const auto is_beyond = [gradient](double value, double min, double max) {
    return (value <= min && gradient >= 0) || (value >= max && gradient <= 0);
  };
  if (unknown == 0) return is_beyond(size, 0, bounds.max_size);
  return unknown == 3 && is_beyond(shape.exponent, bounds.min_exponent, bounds.max_exponent);
}

bool solve_symmetric(std::vector<double>& matrix, std::vector<double>& b, const std::vector<char>& fixed) {
  const auto n = static_cast<Eigen::Index>(b.size());
  Eigen::Map<Eigen::MatrixXd> m(matrix.data(), n, n);
  Eigen::Map<Eigen::VectorXd> x(b.data(), n);
  for (Eigen::Index i = 0; i < n; ++i) {
    if (!fixed[static_cast<std::size_t>(i)]) continue;
    m.row(i).setZero();
    m.col(i).setZero();
    m(i, i) = 1;
    x[i] = 0;
  }
  // In place. Eigen takes NaN on the diagonal for positive.
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factors(m);
  if (factors.info() != Eigen::Success || !(m.diagonal().array() > 0).all()) return false;
  factors.solveInPlace(x);
  return true;
}

}  // namespace selvedge
