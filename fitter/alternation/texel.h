// One texel of a fit with products beside lobes: its own unknowns for given shared functions, and what it
// adds to the normal equations of these.
//
//   f(l, v) = T(v) S(l) g(l', v') + g(l', v') sum_m c_m phi_m(v) psi_m(l)
//
// with g the lobes (lafortune.h), psi a colour and c the same in all channels. Every step makes the texel's
// cost less or leaves it: squared error weighted by opacity, the penalties of lobes and tables
// (channel_problem.h, direction_table.h), and that of products.
#pragma once

#include <array>
#include <vector>

#include "fitter/alternation/shared_functions.h"
#include "fitter/lobes/channel_problem.h"
#include "fitter/lobes/lobe_fit.h"

namespace selvedge {

/// A texel's own unknowns, in units of its samples' scale.
struct ProductState {
  std::array<ChannelState, 3> channels;
  std::vector<double> coefficients;  ///< c
};

struct ProductTexelOptions {
  LobeFitOptions lobes;  ///< with the options of the tables
  /// Pull of the sum of the products to 0 in every pair of directions, in units of the mean of the squared
  /// radiance: where the lobes are dark a ratio to them says nothing and must not explode.
  double pull = DirectionTableOptions().damping;
  /// As much of that pull is on each product by itself: two that are opposite do not grow without end.
  double apart = 0.01;
};

class ProductTexel {
 public:
  /// All must outlive the texel.
  ProductTexel(const TexelSamples& samples, const ProductTexelOptions& options,
               const PreparedFunctions& shared);

  /// Takes a state: what is asked next is of it.
  void take(const ProductState& state);
  ProductState& state() { return state_; }

  /// Unscaled: sums of it over texels are what a level's fit makes least.
  double cost();
  double error();
  double energy() const;

  /// Tables to the mean that costs least, lobes by the inverse. Precondition: c = 0.
  void rescale_tables();
  /// Searches each channel's lobes for given factors. Returns evaluations of the samples.
  int improve_lobes(double tolerance, int iterations);
  /// T and, where the state has one, S.
  void improve_tables();
  /// Sums over samples for given lobes: before the next two.
  void sum(Side side);
  void improve_coefficients();
  /// Adds to the equations of the functions of the side summed last.
  void add_to(FunctionSums& sums);

  /// What the products of a channel should be at each pair of directions, each by itself: [light][view],
  /// those of samples.lights. Beside it the square root of what such a value counts.
  std::vector<float> ratios(std::size_t channel);
  double ratio_weight(std::size_t channel) const;

 private:
  void evaluate_lobes(std::size_t channel);
  void evaluate_products(std::size_t channel);
  void improve_table(std::size_t channel);
  void improve_light_table(std::size_t channel);
  std::vector<float> table_of(std::size_t channel) const;
  float light_factor(std::size_t channel, std::size_t light) const;
  void residual_sums();
  double pull_cost() const;

  const TexelSamples& samples_;
  const ProductTexelOptions& options_;
  const PreparedFunctions& shared_;
  ProductState state_;
  std::vector<float> weight_;                      ///< [view]
  std::array<double, 3> share_{};                  ///< squared scale of a channel, of the largest one's
  double unit_ = 1;                                ///< that one
  std::vector<ChannelProblem> problems_;           ///< of the channels' lobes
  std::array<double, 3> mean_square_{};            ///< of the radiance, over views and lights
  std::array<double, 3> pull_{};                   ///< on a squared product at one pair of directions
  std::array<std::vector<float>, 3> g_;            ///< [light][view]
  std::array<std::vector<float>, 3> products_;     ///< [light][view]: the sum of the products
  std::array<std::vector<float>, 3> square_sums_;  ///< [row][pair], of the side summed last
  std::array<std::vector<float>, 3> cross_sums_;   ///< [row][m]
  std::vector<float> scratch_;
  Side side_ = Side::lights;
};

}  // namespace selvedge
