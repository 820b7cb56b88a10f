#include "fitter/solve/principal.h"

#include <Eigen/Dense>
#include <algorithm>

namespace selvedge {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Principal principal_components(const std::vector<double>& matrix, std::size_t size, std::size_t max_count) {
  const auto n = static_cast<Eigen::Index>(size);
  const Eigen::Map<const RowMajor> symmetric(matrix.data(), n, n);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(symmetric);
  Principal result;
  for (Eigen::Index i = n - 1; i >= 0 && result.values.size() < max_count; --i) {
    result.values.push_back(std::max(0.0, solver.eigenvalues()[i]));
    const Eigen::VectorXd vector = solver.eigenvectors().col(i);
    Eigen::Index largest = 0;
    vector.cwiseAbs().maxCoeff(&largest);
    const double sign = vector[largest] < 0 ? -1 : 1;
    std::vector<double> out(size);
    for (Eigen::Index k = 0; k < n; ++k) out[k] = sign * vector[k];
    result.vectors.push_back(std::move(out));
  }
  return result;
}

}  // namespace selvedge
