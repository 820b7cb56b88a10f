// Sums over the views of a texel in double precision, with the same bits on every processor.
#pragma once

#include <cstddef>

namespace selvedge {

/// Sum of a b over `count` views, a multiple of 8: eight partial sums, then their sum.
double dot(const double* a, const double* b, std::size_t count);

/// to += c a b
void add_product(double* to, double c, const double* a, const double* b, std::size_t count);

/// to += c a
void add_scaled(double* to, double c, const double* a, std::size_t count);

}  // namespace selvedge
