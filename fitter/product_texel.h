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

#include "fitter/channel_problem.h"
#include "fitter/lobe_fit.h"
#include "fitter/product_sums.h"

namespace selvedge {

/// Functions that all texels of a level share, product by product: phi_m[view] and psi_m[3 * light +
/// channel], mean square 1 or 0.
struct SharedFunctions {
  std::vector<std::vector<double>> view;
  std::vector<std::vector<double>> light;
  std::size_t count() const { return view.size(); }
};

/// The same, laid out for sums over samples.
class PreparedFunctions {
 public:
  static constexpr std::size_t most = column_group;

  /// `count` from 1 to `most`; `stride` is that of the texels' samples.
  PreparedFunctions(const SharedFunctions& functions, std::size_t stride);

  std::size_t count() const { return count_; }
  /// Columns of the products of two functions: (m, n), n <= m, at m (m + 1) / 2 + n; and padding.
  std::size_t pair_width() const { return pair_width_; }
  static std::size_t pair(std::size_t m, std::size_t n) { return m * (m + 1) / 2 + n; }

  const float* view_rows() const { return view_rows_.data(); }                        ///< [m][view]
  const float* views() const { return views_.data(); }                                ///< [view][m]
  const float* view_pairs() const { return view_pairs_.data(); }                      ///< [view][pair]
  const float* lights(std::size_t channel) const { return lights_[channel].data(); }  ///< [light][m]
  const float* light_pairs(std::size_t channel) const { return light_pairs_[channel].data(); }
  double view_product(std::size_t m, std::size_t n) const { return view_gram_[m * count_ + n]; }
  double light_product(std::size_t channel, std::size_t m, std::size_t n) const {
    return light_gram_[channel][m * count_ + n];
  }

 private:
  std::size_t count_;
  std::size_t pair_width_;
  std::vector<float> view_rows_;
  std::vector<float> views_;
  std::vector<float> view_pairs_;
  std::array<std::vector<float>, 3> lights_;
  std::array<std::vector<float>, 3> light_pairs_;
  std::vector<double> view_gram_;
  std::array<std::vector<double>, 3> light_gram_;
};

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

/// Which functions the sums are for.
enum class Side { views, lights };

/// Normal equations of the functions of one side, one system for each of its rows (a view; or a light and
/// channel).
struct FunctionSums {
  FunctionSums(Side side, std::size_t rows, std::size_t count);
  void add(const FunctionSums& other);

  Side side;
  std::size_t rows;
  std::size_t count;
  std::vector<double> square;                 ///< [row][pair]
  std::vector<double> cross;                  ///< [row][m]
  std::array<std::vector<double>, 3> pulled;  ///< [channel][pair]: the pull's, of all rows alike; views: [0]
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
