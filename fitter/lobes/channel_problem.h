// The least-squares problem of one colour channel of one texel: lobes and view table together.
//
//   f(l, v) = T(v) l_z ( rho + sum_j size_j max(0, d_j . (l * v))^n_j ),   max |d_j| = 1
//
// is the paper's model (lafortune.h) with C_j = size_j^(1 / n_j) d_j. For given shapes (d, n) sizes and table
// are linear least-squares problems; only the shapes are searched (variable projection, Golub & Pereyra
// 1973).
#pragma once

#include <array>
#include <vector>

#include "fitter/lobes/lobe_step.h"
#include "fitter/solve/texel_samples.h"
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
  void factorise(const double* square);
  /// After factorise(). T = 1 for a direction with square, d and s of 0. `cross`, `table`: [direction].
  void solve(const double* cross, double* table) const;
  /// After factorise(): subtracts b^T A^-1 b, A being the system's matrix, from the upper triangle of
  /// `matrix` (row-major, count x count). b: [direction * count + column]; destroyed.
  void form_schur_complement(std::vector<double>& b, std::size_t count, std::vector<double>& matrix) const;
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

/// The bound on a lobe's peak holds before the table is normalised: in the fabric a lobe may reach its bound
/// times the former mean of the table; T times the lobe is bounded as before.
struct FitOptions {
  int lobes = 2;           ///< 0 to 16
  bool view_table = true;  ///< else T = 1 and the layer is left out
  DirectionTableOptions table{};
  bool has_map = false;     ///< of LayerFitter: products of level 0 alone, whose texels a map shows (Fabric)
  int starts = 3;           ///< short searches per texel and channel; fit() makes more on small levels
  int finalists = 1;        ///< the best of them, which are continued to the end; likewise
  int max_iterations = 60;  ///< of a search
  /// A search ends if an iteration lowers the cost by less than this fraction, or the next one is expected
  /// to.
  double tolerance = 1e-4;
  /// Upper bound of a lobe, in units of the largest radiance over cosine (with a cosine of at least 0.25, as
  /// the ratio has no meaning near the texel's horizon). As l and v are unit vectors, the base of a lobe is
  /// at most max |d| = 1, and the bound holds in every direction, sampled or not.
  double max_peak_ratio = 1;
  /// Penalty on (size / peak)^2, in units of the channel's squared radiance. So small that it affects only
  /// lobes that the data do not determine.
  double ridge = 1e-6;
};

/// A point of the search, in units of the samples' scale.
struct ChannelState {
  std::vector<LobeShape> shapes;
  std::vector<double> sizes;  ///< rho, then each lobe's; >= 0
  std::vector<double> table;  ///< [view]
  double error = 0;           ///< sum over views and lights of w (f - r)^2
  double cost = 0;            ///< error plus penalties, which is minimised
};

/// Gauss-Newton's matrix (row by row) and half the gradient of the cost. Unknowns: rho, then a LobeStep each.
struct NormalEquations {
  std::vector<double> matrix;
  std::vector<double> gradient;
};

class ChannelProblem {
 public:
  /// `samples` must outlive the problem.
  ChannelProblem(const TexelSamples& samples, int channel, const FitOptions& options);

  LobeBounds bounds() const { return {peak_}; }
  /// sum over views and lights of w r^2
  double weighted_squared_radiance() const { return energy_; }

  /// Solves for the sizes and the table of a state alternately, `turns` times, and computes its error and
  /// cost. With `turns` = 0 sizes and table are kept.
  void evaluate(ChannelState& state, int turns);

  /// The normal equations with the table eliminated. Precondition: `state` was evaluated last.
  NormalEquations normal_equations(const ChannelState& state);

 private:
  void gather_bases(const ChannelState& state);
  void solve_sizes(ChannelState& state);
  void sum_model(const ChannelState& state);
  NormalEquations column_equations(const ChannelState& state);

  const TexelSamples& samples_;
  int channel_;
  FitOptions options_;
  double energy_;
  double peak_;
  double ridge_;
  DirectionTableSystem system_;
  std::vector<float> cosine_;                  ///< of each light
  std::array<std::vector<double>, 4> factor_;  ///< [column % 4][view]: 1, x, y, z
  LobeMoments moments_;
  // The shapes evaluated last. Bases: the cosine, then each lobe.
  std::vector<double> products_;     ///< [column * bases + basis][view]
  std::vector<double> basis_gram_;   ///< [i * bases + j][view], j <= i
  std::vector<double> basis_cross_;  ///< [basis][view]: with radiance
  std::vector<double> square_;       ///< [view]: w <g, g>
  std::vector<double> cross_;        ///< [view]: w <g, r>
  // Scratch.
  std::vector<double> weights_;
  std::vector<double> coupling_;
};

}  // namespace selvedge
