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

#include "fitter/lobes/direction_table.h"
#include "fitter/lobes/lobe_step.h"
#include "fitter/solve/texel_samples.h"

namespace selvedge {

struct ChannelOptions {
  bool view_table = true;  ///< else T = 1
  DirectionTableOptions table;
  double min_exponent = 1;
  double max_exponent = LobeBounds().max_exponent;
  /// Upper bound of a lobe, in units of the largest radiance over cosine (with a cosine of at least 0.25, as
  /// the ratio has no meaning near the texel's horizon). As l and v are unit vectors, the base of a lobe is
  /// at most max |d| = 1, and the bound holds in every direction, sampled or not.
  double peak = 1;
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
  ChannelProblem(const TexelSamples& samples, int channel, const ChannelOptions& options);

  LobeBounds bounds() const { return {peak_, options_.min_exponent, options_.max_exponent}; }
  /// sum over views and lights of w r^2
  double energy() const { return energy_; }
  /// Upper bound of a lobe.
  double peak() const { return peak_; }

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
  ChannelOptions options_;
  double energy_;
  double peak_;
  double ridge_;
  DirectionTableSystem system_;
  std::vector<float> cosine_;                  ///< of each light
  std::array<std::vector<double>, 4> factor_;  ///< [column % 4][view]: 1, x, y, z
  LobeMoments moments_;
  // Of the shapes evaluated last. Bases: the cosine, then each lobe.
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
