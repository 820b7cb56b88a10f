#include "fitter/refit_to_pairs.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "fitter/lobes/lobe_step.h"
#include "format/base/parallel.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/lafortune.h"
#include "format/samples/pool.h"

namespace selvedge {
namespace {

/// Of a channel of a texel. With more its equations take too long.
constexpr int max_unknowns = 300;

/// A pair in the frame of a texel.
struct TexelPair {
  std::array<double, 3> product{};  ///< l' v' by component
  double cosine = 0;                ///< of the light, > 0
  double weight = 0;                ///< opacity
  DirectionTaps taps{};             ///< of the view table, weighted by its opacities; sum 1
  std::size_t index = 0;            ///< among all pairs
};

/// One channel of a texel: f = T(v) l'_z ( rho + sum of max(0, c_j)^n_j ), linear in the entries of T.
/// Unknowns: rho, then c and log n of each lobe, then the table.
class PairProblem {
 public:
  PairProblem(const std::vector<TexelPair>& pairs, std::vector<double> values, const FitOptions& options,
              const DirectionGrid& views, int lights)
      : pairs_(pairs), values_(std::move(values)), lobes_(options.lobes), views_(views) {
    double energy = 0;
    double weight = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      energy += pairs[i].weight * values_[i] * values_[i];
      weight += pairs[i].weight;
      peak_ = std::max(peak_, values_[i] / std::max(pairs[i].cosine, 0.25));
    }
    table_size_ = options.view_table ? views.count() : 0;
    if (!(weight > 0)) return;
    // As strong as in the fit to the grids (direction_table.h), where a view has a sample for each light.
    const double of_view = energy / weight * lights;
    damping_ = options.table.damping * of_view;
    smoothness_ = options.table.smoothness * of_view;
  }

  int unknowns() const { return first_entry() + table_size_; }
  int first_entry() const { return parameter_count(lobes_); }

  /// Raises the bound of lobes to those of `x`, which the samples of the grids had bounds for.
  void allow(const Eigen::VectorXd& x) {
    for (int j = 0; j < lobes_; ++j) {
      const double longest = x.segment<3>(1 + 4 * j).cwiseAbs().maxCoeff();
      peak_ = std::max(peak_, positive_power(longest, std::exp(x[4 + 4 * j])));
    }
  }

  /// Sum of weighted squares plus penalties at `x`; `start` is where the search began.
  double cost(const Eigen::VectorXd& x, const Eigen::VectorXd& start) const {
    double sum = penalty(x - start, nullptr, nullptr);
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      const double e = entry(x, pairs_[i]) * bracket(x, pairs_[i], nullptr) - values_[i];
      sum += pairs_[i].weight * e * e;
    }
    return sum;
  }

  /// Gauss-Newton's matrix and half the gradient.
  void equations(const Eigen::VectorXd& x, const Eigen::VectorXd& start, Eigen::MatrixXd& matrix,
                 Eigen::VectorXd& gradient) const {
    matrix.setZero(unknowns(), unknowns());
    gradient.setZero(unknowns());
    std::vector<double> slope(first_entry());
    std::vector<std::pair<int, double>> row;
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      const TexelPair& pair = pairs_[i];
      const double g = bracket(x, pair, slope.data());
      const double t = entry(x, pair);
      row.clear();
      for (int k = 0; k < first_entry(); ++k) {
        if (slope[k] != 0) row.emplace_back(k, t * slope[k]);
      }
      for (int k = 0; k < 4 && table_size_ > 0; ++k) {
        const auto share = static_cast<double>(pair.taps.weight[k]);
        if (share != 0) row.emplace_back(first_entry() + pair.taps.cell[k], g * share);
      }
      const double e = t * g - values_[i];
      for (const auto& [a, da] : row) {
        gradient[a] += pair.weight * da * e;
        for (const auto& [b, db] : row) matrix(a, b) += pair.weight * da * db;
      }
    }
    penalty(x - start, &matrix, &gradient);
  }

  /// Within the bounds of the fabric's parameters and of the peak.
  void clamp(Eigen::VectorXd& x) const {
    const LobeBounds bounds;
    x[0] = std::max(x[0], 0.0);
    for (int j = 0; j < lobes_; ++j) {
      double* lobe = &x[1 + 4 * j];
      lobe[3] = std::clamp(lobe[3], std::log(bounds.min_exponent), std::log(bounds.max_exponent));
      const double longest = std::max({std::abs(lobe[0]), std::abs(lobe[1]), std::abs(lobe[2])});
      const double most = std::pow(peak_, std::exp(-lobe[3]));
      for (int k = 0; k < 3 && longest > most; ++k) lobe[k] *= most / longest;
    }
    for (int v = first_entry(); v < unknowns(); ++v) x[v] = std::max(x[v], 0.0);
  }

 private:
  /// T(v).
  double entry(const Eigen::VectorXd& x, const TexelPair& pair) const {
    if (table_size_ == 0) return 1;
    double sum = 0;
    for (int k = 0; k < 4; ++k) {
      sum += static_cast<double>(pair.taps.weight[k]) * x[first_entry() + pair.taps.cell[k]];
    }
    return sum;
  }

  /// The formula without T, and its derivatives by lobes' unknowns unless `slope` is null.
  double bracket(const Eigen::VectorXd& x, const TexelPair& pair, double* slope) const {
    double sum = x[0];
    if (slope != nullptr) slope[0] = pair.cosine;
    for (int j = 0; j < lobes_; ++j) {
      const double* lobe = &x[1 + 4 * j];
      const double n = std::exp(lobe[3]);
      const double base = lobe[0] * pair.product[0] + lobe[1] * pair.product[1] + lobe[2] * pair.product[2];
      const double power = positive_power(base, n);
      sum += power;
      if (slope == nullptr) continue;
      const double by_base = power > 0 ? pair.cosine * n * power / base : 0;
      for (int k = 0; k < 3; ++k) slope[1 + 4 * j + k] = by_base * pair.product[k];
      slope[4 + 4 * j] = power > 0 ? pair.cosine * n * power * std::log(base) : 0;
    }
    return sum * pair.cosine;
  }

  /// d sum D^2 + s sum (D_u - D_v)^2 of the changes D of the table, with (u, v) the neighbours; adds its
  /// matrix and half its gradient.
  double penalty(const Eigen::VectorXd& change, Eigen::MatrixXd* matrix, Eigen::VectorXd* gradient) const {
    double sum = 0;
    const auto add = [&](double factor, int u, int v) {
      const double d = change[u] - (v < 0 ? 0 : change[v]);
      sum += factor * d * d;
      if (matrix == nullptr) return;
      (*matrix)(u, u) += factor;
      (*gradient)[u] += factor * d;
      if (v < 0) return;
      (*matrix)(v, v) += factor;
      (*matrix)(u, v) -= factor;
      (*matrix)(v, u) -= factor;
      (*gradient)[v] -= factor * d;
    };
    for (int v = 0; v < table_size_; ++v) {
      const int u = first_entry() + v;
      add(damping_, u, -1);
      if (v % views_.columns > 0) add(smoothness_, u, u - 1);
      if (v >= views_.columns) add(smoothness_, u, u - views_.columns);
    }
    return sum;
  }

  const std::vector<TexelPair>& pairs_;
  std::vector<double> values_;
  int lobes_;
  DirectionGrid views_;
  int table_size_ = 0;
  double damping_ = 0;
  double smoothness_ = 0;
  double peak_ = 0;
};

/// Levenberg-Marquardt with clamped steps.
void minimise(const PairProblem& problem, const FitOptions& options, Eigen::VectorXd& x) {
  const Eigen::VectorXd start = x;
  Eigen::MatrixXd matrix;
  Eigen::VectorXd gradient;
  double cost = problem.cost(x, start);
  double lambda = 1e-3;
  bool moved = true;
  for (int i = 0; i < options.max_iterations && lambda < 1e8; ++i) {
    if (moved) problem.equations(x, start, matrix, gradient);
    Eigen::MatrixXd damped = matrix;
    damped.diagonal() *= 1 + lambda;
    damped.diagonal().array() += 1e-12 * matrix.diagonal().maxCoeff() + std::numeric_limits<double>::min();
    Eigen::VectorXd trial = x - damped.llt().solve(gradient);
    if (trial.allFinite()) problem.clamp(trial);
    const double next =
        trial.allFinite() ? problem.cost(trial, start) : std::numeric_limits<double>::infinity();
    moved = next < cost;
    lambda = moved ? std::max(1e-9, lambda * 0.3) : lambda * 8;
    if (!moved) continue;
    x = trial;
    if (cost - next <= options.tolerance * cost) return;
    cost = next;
  }
}

/// The pairs that light and show the texel.
std::vector<TexelPair> pairs_of(const FabricLevel& level, const DirectionGrid& views, std::size_t texel,
                                const std::vector<DirectionPair>& directions, const float* opacity) {
  const TexelFrame frame =
      level.has(LayerKind::frame) ? level.frame()[texel] : TexelFrame{{0, 0, 1}, {1, 0, 0}};
  const V3f binormal = frame.normal % frame.tangent;
  const auto local = [&](const V3f& d) { return V3f(d ^ frame.tangent, d ^ binormal, d ^ frame.normal); };
  std::vector<TexelPair> pairs;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    TexelPair pair;
    const V3f l = local(directions[i].light);
    const V3f v = local(directions[i].view);
    for (int k = 0; k < 3; ++k) pair.product[k] = static_cast<double>(l[k] * v[k]);
    pair.cosine = static_cast<double>(l.z);
    pair.weight = static_cast<double>(opacity[i]);
    pair.index = i;
    pair.taps = interpolate(views, directions[i].view);
    float sum = 0;
    for (int k = 0; k < 4; ++k) {
      pair.taps.weight[k] *= level.opacity()[texel * views.count() + pair.taps.cell[k]];
      sum += pair.taps.weight[k];
    }
    if (!(sum > 0 && l.z > 0 && pair.weight > 0)) continue;
    for (float& weight : pair.taps.weight) weight /= sum;
    pairs.push_back(pair);
  }
  return pairs;
}

/// Scales the table behind the parameters to a mean of 1, weighted by opacity, and the lobes by the inverse.
void normalise(std::span<const float> opacity, int parameters, Eigen::VectorXd& x) {
  if (x.size() == parameters) return;
  double sum = 0;
  double weight = 0;
  for (std::size_t v = 0; v < opacity.size(); ++v) {
    sum += static_cast<double>(opacity[v]) * x[parameters + static_cast<Eigen::Index>(v)];
    weight += static_cast<double>(opacity[v]);
  }
  if (!(sum > 0)) return;
  const double mean = sum / weight;
  for (std::size_t v = 0; v < opacity.size(); ++v) {
    // Of a hole the entry has no meaning, and nothing bounds it.
    double& entry = x[parameters + static_cast<Eigen::Index>(v)];
    entry = opacity[v] > 0 ? entry / mean : 1;
  }
  x[0] *= mean;
  for (int k = 1; k < parameters; k += 4) x.segment<3>(k) *= std::pow(mean, 1 / x[k + 3]);
}

void refit_texel(FabricLevel& level, const DirectionGrid& views, std::size_t texel,
                 const std::vector<DirectionPair>& directions, const SampleLevel& samples,
                 const FitOptions& options, int lights) {
  const std::size_t first = texel * directions.size();
  const auto pairs = pairs_of(level, views, texel, directions, &samples.alpha[first]);
  const int parameters = parameter_count(options.lobes);
  for (int c = 0; c < 3; ++c) {
    std::vector<double> values;
    for (const TexelPair& pair : pairs)
      values.push_back(static_cast<double>(samples.radiance[first + pair.index][c]));
    PairProblem problem(pairs, std::move(values), options, views, lights);
    if (problem.unknowns() > std::min(static_cast<int>(pairs.size()), max_unknowns)) continue;
    float* lobes = &level.lobes()[(texel * 3 + c) * parameters];
    V3f* table = options.view_table ? &level.view_table()[texel * views.count()] : nullptr;
    Eigen::VectorXd x(problem.unknowns());
    for (int k = 0; k < parameters; ++k) x[k] = static_cast<double>(lobes[k]);
    // A lobe of size 0 has no direction to begin with, and stays dark.
    for (int j = 0; j < options.lobes; ++j) x[4 + 4 * j] = std::log(std::max(x[4 + 4 * j], 1.0));
    for (int v = parameters; v < problem.unknowns(); ++v)
      x[v] = static_cast<double>(table[v - parameters][c]);
    problem.allow(x);
    minimise(problem, options, x);
    for (int j = 0; j < options.lobes; ++j) x[4 + 4 * j] = std::exp(x[4 + 4 * j]);
    normalise(level.opacity().subspan(texel * views.count(), views.count()), parameters, x);
    for (int k = 0; k < parameters; ++k) lobes[k] = static_cast<float>(x[k]);
    for (int v = parameters; v < problem.unknowns(); ++v) table[v - parameters][c] = static_cast<float>(x[v]);
  }
}

}  // namespace

void refit_to_pairs(Fabric& fabric, const PairSamples& measured, int lights, const FitOptions& options) {
  if (measured.pairs.empty()) return;
  // Every pair as a view with one light.
  SampleLevel samples;
  samples.width = measured.width;
  samples.height = measured.height;
  samples.views = static_cast<int>(measured.pairs.size());
  samples.lights = 1;
  const std::size_t texels = samples.texels();
  samples.normal.assign(texels, V3f(0));
  for (std::size_t t = 0; t < texels; ++t) {
    for (std::size_t p = 0; p < measured.pairs.size(); ++p) {
      samples.alpha.push_back(measured.alpha[p * texels + t]);
      samples.radiance.push_back(measured.radiance[p * texels + t]);
    }
  }
  for (FabricLevel& level : fabric.levels) {
    if (&level != &fabric.levels.front()) samples = pool(samples);
    parallel_for(0, level.texels(), [&](std::size_t texel) {
      refit_texel(level, fabric.views, texel, measured.pairs, samples, options, lights);
    });
  }
}

}  // namespace selvedge
