// Solver of small dense systems of normal equations.
#pragma once

#include <vector>

namespace selvedge {

/// Solves matrix x = b by Cholesky's factorisation, with x = 0 for unknowns that are `fixed`. `matrix`:
/// row-major, symmetric; it is overwritten, b becomes x. False if the matrix is not positive definite.
bool solve_symmetric(std::vector<double>& matrix, std::vector<double>& b, const std::vector<char>& fixed);

}  // namespace selvedge
