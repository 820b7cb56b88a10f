// The least-squares problem of one colour channel of one texel: lobes and view table together.
//
//   f(l, v) = T(v) S(l) l_z ( rho + sum_j size_j max(0, d_j . (l * v))^n_j ),   max |d_j| = 1
//
// is the paper's model (lafortune.h) with C_j = size_j^(1 / n_j) d_j, and on request a table over lights. For
// given shapes (d, n) the sizes and the table are each a linear problem; only the shapes are searched
// (variable projection, Golub & Pereyra 1973).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "fitter/lobes/direction_table.h"
#include "fitter/lobes/lobe_step.h"
#include "fitter/solve/texel_samples.h"

namespace selvedge {

struct ChannelOptions {
  bool view_table = true;    ///< else T = 1
  bool light_table = false;  ///< else S = 1
  DirectionTableOptions table;
  double min_exponent = 1;
  double max_exponent = LobeBounds().max_exponent;
  /// The most that a lobe may reach anywhere, in units of the largest radiance over cosine (cosine taken as
  /// at least 0.25: near the texel's horizon the ratio says nothing). As l and v are unit vectors the base of
  /// a lobe is at most max |d| = 1: the bound holds in every direction, seen or not.
  double peak = 1;
  /// Penalty on (size / peak)^2, in units of the channel's squared radiance. It decides only where the data
  /// say nothing: a lobe without evidence fades.
  double ridge = 1e-6;
};

/// A point of the search. In units of the samples' scale.
struct ChannelState {
  std::vector<LobeShape> shapes;
  std::vector<double> sizes;        ///< rho, then each lobe's; >= 0
  std::vector<double> table;        ///< [view]
  std::vector<double> light_table;  ///< S of all lights; empty: 1
  double error = 0;                 ///< sum over views and lights of w (f - r)^2
  double cost = 0;                  ///< the error and all penalties, which is minimised
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
  /// The most that a lobe may reach.
  double peak() const { return peak_; }

  /// Improves the sizes and the table of a state by turns, for its shapes, and computes its error and cost.
  /// With `turns` = 0 sizes and table stay.
  void evaluate(ChannelState& state, int turns);

  /// Gives the state the light table that is best with its lobes and view table; its cost is not computed.
  void fit_light_table(ChannelState& state) const;

  /// At the state that was evaluated last, with the table eliminated.
  NormalEquations normal_equations(const ChannelState& state);

 private:
  void set_cosines(const ChannelState& state);
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
  DirectionTableSystem light_system_;
  std::vector<float> cosine_;                  ///< of each light, times S
  std::array<std::vector<double>, 4> factor_;  ///< of a column, by view: 1, x, y, z
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
