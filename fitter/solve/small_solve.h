// Small dense systems of normal equations.
#pragma once

#include <vector>

namespace selvedge {

/// Solves matrix x = b by Cholesky's factorisation; unknowns that are `fixed` are left out and come out as 0.
/// matrix: row-major, symmetric; it is overwritten, b becomes x. False where the matrix is not positive
/// definite.
bool solve_symmetric(std::vector<double>& matrix, std::vector<double>& b, const std::vector<char>& fixed);

}  // namespace selvedge
