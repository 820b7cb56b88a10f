// A table over directions, of one channel of one texel, in closed form: T over views (Daubert et al. 2001,
// equation (4), regularised), and S over lights likewise.
#pragma once

#include <span>
#include <vector>

#include "format/fabric/directions.h"

namespace selvedge {

struct DirectionTableOptions {
  /// Pull of every entry towards 1, and of neighbouring directions towards each other, in units of the mean
  /// over directions of the squared radiance. Where the lobes are almost dark, or
  /// the view sees a hole, the samples say little or nothing about T: the entry follows its neighbours,
  /// and 1.
  double damping = 0.05;
  double smoothness = 0.05;
};

/// T is the minimiser of
///   sum_v (square_v T_v^2 - 2 cross_v T_v)  +  d sum_v (T_v - 1)^2  +  s sum_(u, v) (T_u - T_v)^2
/// with (u, v) the neighbours in the grid of directions, square = w <g, g> and cross = w <g, r>. No entry is
/// negative where no cross is. With d, s > 0 an entry is at most 1 + sqrt(sum_v w <r, r> / (4 d)): the table
/// cannot explode.
class DirectionTableSystem {
 public:
  /// `grid`: 0 x 0 where no directions are neighbours.
  DirectionTableSystem(std::size_t directions, const DirectionGrid& grid, double d, double s);

  /// Takes the system's matrix apart. `square`: [direction].
  void factor(const double* square);
  /// After factor(). A direction without square, d and s keeps T = 1. `cross`, `table`: [direction].
  void solve(const double* cross, double* table) const;
  /// After factor(): b^T matrix^-1 b of several right-hand sides, subtracted from `from` (upper triangle,
  /// row-major). b: [direction * count + which]; destroyed.
  void subtract_eliminated(std::vector<double>& b, std::size_t count, std::vector<double>& from) const;
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
