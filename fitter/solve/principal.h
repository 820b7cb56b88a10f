// Principal components of symmetric matrices.
#pragma once

#include <cstddef>
#include <vector>

namespace selvedge {

/// Eigenvalues and eigenvectors of a symmetric matrix, the largest eigenvalue first.
struct Principal {
  std::vector<double> values;                ///< >= 0; negative ones are rounding errors and set to 0
  std::vector<std::vector<double>> vectors;  ///< unit; the component of largest magnitude is positive
};

/// At most `max_count` components. `matrix`: size * size, positive semidefinite, finite; only the lower
/// triangle is read.
Principal principal_components(const std::vector<double>& matrix, std::size_t size, std::size_t max_count);

}  // namespace selvedge
