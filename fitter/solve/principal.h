// Principal components of symmetric matrices.
#pragma once

#include <cstddef>
#include <vector>

namespace selvedge {

/// Eigenvectors of a symmetric matrix, the largest eigenvalue first.
struct Principal {
  std::vector<double> values;                ///< >= 0; negative ones are rounding and are 0
  std::vector<std::vector<double>> vectors;  ///< unit; the entry of largest magnitude is positive
};

/// `matrix`: size * size, of which the lower triangle counts; positive semidefinite. Precondition: finite.
Principal principal_components(const std::vector<double>& matrix, std::size_t size, std::size_t most);

}  // namespace selvedge
