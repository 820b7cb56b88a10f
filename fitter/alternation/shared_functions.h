// Functions of a view and of a light that all texels of a level share, product by product: laid out for sums
// over samples, and the normal equations that texels add to.
#pragma once

#include <array>
#include <vector>

#include "fitter/alternation/sums.h"

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

}  // namespace selvedge
