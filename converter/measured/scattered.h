// Interpolation of values that are known at scattered pairs of light and view, of which any set will do, by
// Gaussian processes (kriging): Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006,
// section 2.2. All columns of values share the weights.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "format/fabric/directions.h"

namespace selvedge {

/// The covariance of two pairs: Matern's of smoothness 3/2 of the distances of lights and views in Lambert's
/// equal-area disc (radius 1) over their scales, plus a trend that is bilinear in light and view.
struct PairCovariance {
  double light_scale = 1;
  double view_scale = 0.6;
  double trend_variance = 1;     ///< variance of the trend
  double noise_variance = 0.02;  ///< variance of independent noise in every picture
  /// Relative root mean square error of the choice at pairs that are left out one by one.
  double leave_one_out_error = 0;
};

/// Values at pairs, [pair][column].
struct PairValues {
  std::vector<DirectionPair> pairs;  ///< all different
  Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> values;
};

/// The kernel with the least error at pairs that are left out one by one, of at most 600 random ones.
PairCovariance choose_covariance(const PairValues& known, std::uint64_t seed);

/// The values at each of `pairs`, [pair][column]. Of more than 2,000 known pairs those whose views are
/// nearest to the view of the first of `pairs` are used: time and memory are bounded.
Eigen::MatrixXf interpolate(const PairValues& known, const PairCovariance& kernel,
                            std::span<const DirectionPair> pairs);

}  // namespace selvedge
