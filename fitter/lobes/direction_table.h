// The table over views of one channel of a texel, by linear least squares (Daubert et al. 2001, equation (4),
// regularised).
#pragma once

#include <vector>

#include "format/fabric/directions.h"

namespace selvedge {

struct DirectionTableOptions {
  /// Penalties on the difference of an entry from 1 (damping) and from its neighbours (smoothness), in units
  /// of the mean over directions of the squared radiance. They determine T where the samples do not: in views
  /// in which the lobes are almost dark or the texel is a hole.
  double damping = 0.05;
  double smoothness = 0.05;
};

/// T is the minimiser of
///   sum_v (square_v T_v^2 - 2 cross_v T_v)  +  d sum_v (T_v - 1)^2  +  s sum_(u, v) (T_u - T_v)^2
/// with (u, v) the neighbours in the grid of directions, square = w <g, g> and cross = w <g, r>. If no cross
/// is negative, no entry is. With d, s > 0 entries are at most 1 + sqrt(sum_v w <r, r> / (4 d)).
class DirectionTableSystem {
 public:
  /// `grid`: 0 x 0 if no directions are neighbours.
  DirectionTableSystem(std::size_t directions, const DirectionGrid& grid, double d, double s);

  /// Factorises the system's matrix. `square`: [direction].
  void factor(const double* square);
  /// After factor(). T = 1 for a direction with square, d and s of 0. `cross`, `table`: [direction].
  void solve(const double* cross, double* table) const;
  /// After factor(): subtracts b^T A^-1 b, A being the system's matrix, from the upper triangle of `matrix`
  /// (row-major, count x count). b: [direction * count + column]; destroyed.
  void subtract_eliminated(std::vector<double>& b, std::size_t count, std::vector<double>& matrix) const;
  /// d sum (T - 1)^2 + s sum (T_u - T_v)^2
  double penalty(const double* table) const;

 private:
  std::size_t count_;
  std::size_t columns_;  ///< of the grid, which is the matrix's bandwidth; 0 without smoothness
  double damping_;
  double smoothness_;
  std::vector<double> penalties_;  ///< the penalty's diagonal
  /// matrix = L D L^T. [direction][1 + columns_]: 1 / D (0 where D is 0), then L below the diagonal.
  std::vector<double> band_;
};

}  // namespace selvedge
