#include "converter/measured/scattered.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "format/base/random.h"

namespace selvedge {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A pair as the kernel takes it.
struct PairPoint {
  V3d light;
  V3d view;
  V2d light_disc;
  V2d view_disc;
};

V2d disc(const V3d& d) { return V2d(d.x, d.y) / std::sqrt(1 + std::max(d.z, 0.0)); }

PairPoint place_of(const DirectionPair& pair) {
  const V3d light(pair.light);
  const V3d view(pair.view);
  return {light, view, disc(light), disc(view)};
}

double covariance(const PairPoint& a, const PairPoint& b, const PairCovariance& k) {
  const double light = (a.light_disc - b.light_disc).length2() / (k.light_scale * k.light_scale);
  const double view = (a.view_disc - b.view_disc).length2() / (k.view_scale * k.view_scale);
  const double q = std::sqrt(3 * (light + view));
  return (1 + q) * std::exp(-q) + k.trend_variance * (1 + a.light.dot(b.light)) * (1 + a.view.dot(b.view));
}

Eigen::LLT<MatrixXd> factor(const std::vector<PairPoint>& known, const PairCovariance& kernel) {
  const auto count = static_cast<Eigen::Index>(known.size());
  MatrixXd matrix(count, count);
  for (Eigen::Index j = 0; j < count; ++j) {
    for (Eigen::Index i = j; i < count; ++i) matrix(i, j) = covariance(known[i], known[j], kernel);
    matrix(j, j) += kernel.noise_variance;
  }
  return Eigen::LLT<MatrixXd>(matrix);
}

/// The error at a pair that is left out is its coefficient over the diagonal of the inverse (Rasmussen and
/// Williams, equation 5.12).
double error_left_out(const std::vector<PairPoint>& known, const MatrixXd& values,
                      const PairCovariance& kernel) {
  const Eigen::LLT<MatrixXd> solver = factor(known, kernel);
  MatrixXd inverse = MatrixXd::Identity(values.rows(), values.rows());
  solver.matrixL().solveInPlace(inverse);
  const VectorXd diagonal = inverse.colwise().squaredNorm();
  const MatrixXd errors = diagonal.cwiseInverse().asDiagonal() * solver.solve(values);
  return errors.norm() / values.norm();
}

}  // namespace

PairCovariance choose_covariance(const PairValues& known, std::uint64_t seed) {
  constexpr std::size_t max_pairs = 600;
  constexpr Eigen::Index sketches = 48;
  Random random(seed);
  std::vector<Eigen::Index> chosen(known.pairs.size());
  std::iota(chosen.begin(), chosen.end(), 0);
  for (std::size_t i = chosen.size(); i > 1; --i) std::swap(chosen[i - 1], chosen[random.next() % i]);
  chosen.resize(std::min(chosen.size(), max_pairs));
  // Sums of the columns with random signs have the columns' mean errors (Johnson and Lindenstrauss 1984).
  MatrixXd sketch = MatrixXd::Zero(static_cast<Eigen::Index>(chosen.size()), sketches);
  for (Eigen::Index column = 0; column < known.values.cols(); ++column) {
    const std::uint64_t signs = random.next();
    for (Eigen::Index i = 0; i < sketch.rows(); ++i) {
      const auto value = static_cast<double>(known.values(chosen[i], column));
      for (Eigen::Index s = 0; s < sketches; ++s) sketch(i, s) += (signs >> s & 1U) != 0 ? value : -value;
    }
  }
  std::vector<PairPoint> places;
  for (const Eigen::Index i : chosen) places.push_back(place_of(known.pairs[i]));

  PairCovariance best;
  // Values that are all 0 are as well interpolated by any.
  if (sketch.norm() == 0) return best;
  best.leave_one_out_error = error_left_out(places, sketch, best);
  for (const double step : {2.0, 2.0, 1.4, 1.2}) {
    for (double PairCovariance::*parameter :
         {&PairCovariance::light_scale, &PairCovariance::view_scale, &PairCovariance::noise_variance,
          &PairCovariance::trend_variance}) {
      for (const double factor : {step, 1 / step}) {
        for (bool better = true; better;) {
          PairCovariance next = best;
          next.*parameter = std::clamp(best.*parameter * factor, 1e-4, 1e4);
          next.leave_one_out_error = error_left_out(places, sketch, next);
          better = next.leave_one_out_error < 0.9999 * best.leave_one_out_error;
          if (better) best = next;
        }
      }
    }
  }
  return best;
}

Eigen::MatrixXf interpolate(const PairValues& known, const PairCovariance& kernel,
                            std::span<const DirectionPair> pairs) {
  constexpr std::size_t max_pairs = 2000;
  std::vector<PairPoint> wanted;
  for (const DirectionPair& pair : pairs) wanted.push_back(place_of(pair));
  std::vector<Eigen::Index> used(known.pairs.size());
  std::iota(used.begin(), used.end(), 0);
  if (used.size() > max_pairs) {
    std::ranges::stable_sort(used, {}, [&](Eigen::Index i) {
      return (place_of(known.pairs[i]).view_disc - wanted.front().view_disc).length2();
    });
    used.resize(max_pairs);
  }
  std::vector<PairPoint> places;
  for (const Eigen::Index i : used) places.push_back(place_of(known.pairs[i]));
  MatrixXd weights(static_cast<Eigen::Index>(places.size()), static_cast<Eigen::Index>(wanted.size()));
  for (Eigen::Index j = 0; j < weights.cols(); ++j)
    for (Eigen::Index i = 0; i < weights.rows(); ++i)
      weights(i, j) = covariance(places[i], wanted[j], kernel);
  factor(places, kernel).solveInPlace(weights);
  Eigen::MatrixXf values = Eigen::MatrixXf::Zero(weights.cols(), known.values.cols());
  for (Eigen::Index i = 0; i < weights.rows(); ++i)
    values.noalias() += weights.row(i).transpose().cast<float>() * known.values.row(used[i]);
  return values;
}

}  // namespace selvedge
