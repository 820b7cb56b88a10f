#include "fitter/solve/small_solve.h"

#include <Eigen/Cholesky>

namespace selvedge {

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
