#include "fitter/fit.h"

#include <ceres/ceres.h>
#include <glog/logging.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "fitter/lobes/lobe_step.h"
#include "format/base/parallel.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/lafortune.h"
#include "format/samples/pool.h"

namespace selvedge {
namespace {

/// Maximum for a channel of a texel: with more its equations take too long.
constexpr int max_unknowns = 300;

/// A pair in the frame of a texel.
struct TexelPair {
  V3d product{0, 0, 0};                       ///< l' v' by component
  double cosine = 0;                          ///< of the light, > 0
  double weight = 0;                          ///< opacity
  std::vector<std::pair<int, double>> views;  ///< entries of the view table, by their opacities; sum 1
  std::size_t index = 0;                      ///< among all pairs
};

/// root of w (T(v) l'_z ( rho + sum of max(0, c_j)^n_j ) - value). Parameters: rho, then c and log n of each
/// lobe; then the entries of T that the pair meets, or none for T = 1.
class PairResidual : public ceres::CostFunction {
 public:
  PairResidual(const TexelPair& pair, double value, int lobes, bool table)
      : pair_(pair), value_(value), lobes_(lobes), entries_(table ? pair.views.size() : 0) {
    set_num_residuals(1);
    mutable_parameter_block_sizes()->assign(1 + entries_, 1);
    mutable_parameter_block_sizes()->front() = parameter_count(lobes);
  }

  bool Evaluate(double const* const* x, double* residual, double** slopes) const override {
    double table = entries_ > 0 ? 0 : 1;
    for (std::size_t k = 0; k < entries_; ++k) table += pair_.views[k].second * x[k + 1][0];
    const double root = std::sqrt(pair_.weight);
    double* const by_lobes = slopes != nullptr ? slopes[0] : nullptr;
    const double by_sum = root * table * pair_.cosine;
    double sum = x[0][0];
    if (by_lobes != nullptr) by_lobes[0] = by_sum;
    for (int k = 1; k < parameter_count(lobes_); k += 4) {
      const double* const lobe = x[0] + k;
      const double n = std::exp(lobe[3]);
      const double base = V3d(lobe[0], lobe[1], lobe[2]).dot(pair_.product);
      const double power = positive_power(base, n);
      sum += power;
      if (by_lobes == nullptr) continue;
      const double by_base = power > 0 ? by_sum * n * power / base : 0;
      for (int i = 0; i < 3; ++i) by_lobes[k + i] = by_base * pair_.product[i];
      by_lobes[k + 3] = power > 0 ? by_sum * n * power * std::log(base) : 0;
    }
    residual[0] = root * (table * pair_.cosine * sum - value_);
    for (std::size_t k = 0; slopes != nullptr && k < entries_; ++k)
      if (slopes[k + 1] != nullptr) slopes[k + 1][0] = root * pair_.cosine * sum * pair_.views[k].second;
    return true;
  }

 private:
  const TexelPair& pair_;
  double value_;
  int lobes_;
  std::size_t entries_;
};

/// root (u - start), or root (u - v - start).
struct Change {
  double root;
  double start;
  template <class T>
  bool operator()(const T* u, T* residual) const {
    residual[0] = root * (u[0] - start);
    return true;
  }
  template <class T>
  bool operator()(const T* u, const T* v, T* residual) const {
    residual[0] = root * (u[0] - v[0] - start);
    return true;
  }
};

/// Fits `lobes` (with log n, in units of the channel's peak: then |c| <= 1 bounds a lobe for every exponent)
/// and `table` (empty: T = 1) to `values` in the same unit. False without a solution.
bool solve(const std::vector<TexelPair>& pairs, const std::vector<double>& values, const DirectionGrid& views,
           int lights, const FitOptions& options, double* lobes, std::vector<double>& table) {
  ceres::Problem problem;
  const LobeBounds bounds;
  const int parameters = parameter_count(options.lobes);
  problem.AddParameterBlock(lobes, parameters);
  problem.SetParameterLowerBound(lobes, 0, 0);
  for (int j = 1; j < parameters; ++j) {
    const bool exponent = j % 4 == 0;
    problem.SetParameterLowerBound(lobes, j, exponent ? std::log(bounds.min_exponent) : -1);
    problem.SetParameterUpperBound(lobes, j, exponent ? std::log(bounds.max_exponent) : 1);
  }
  double energy = 0;
  double weight = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    energy += pairs[i].weight * values[i] * values[i];
    weight += pairs[i].weight;
    std::vector<double*> blocks{lobes};
    for (const auto& [view, factor] : pairs[i].views)
      if (!table.empty()) blocks.push_back(&table[view]);
    problem.AddResidualBlock(new PairResidual(pairs[i], values[i], options.lobes, !table.empty()), nullptr,
                             blocks);
  }
  // As strong as in the fit to the grids (lobes/channel_problem.h), where a view has a sample for each light.
  const double of_view = energy / weight * lights;
  const double damping = std::sqrt(options.table.damping * of_view);
  const double smoothness = std::sqrt(options.table.smoothness * of_view);
  const auto join = [&](int u, int v) {
    auto* change = new Change{smoothness, table[u] - table[v]};
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Change, 1, 1, 1>(change), nullptr, &table[u],
                             &table[v]);
  };
  for (int v = 0; v < static_cast<int>(table.size()); ++v) {
    auto* change = new Change{damping, table[v]};
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Change, 1, 1>(change), nullptr, &table[v]);
    problem.SetParameterLowerBound(&table[v], 0, 0);
    if (v % views.columns > 0) join(v, v - 1);
    if (v >= views.columns) join(v, v - views.columns);
  }
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  solver.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
  solver.max_num_iterations = options.max_iterations;
  solver.function_tolerance = options.tolerance;
  solver.initial_trust_region_radius = 10;  // the start, the fit to the grids, is near
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  return summary.IsSolutionUsable();
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
    pair.product = V3d(l * v);
    pair.cosine = static_cast<double>(l.z);
    pair.weight = static_cast<double>(opacity[i]);
    pair.index = i;
    const DirectionTaps taps = interpolate(views, directions[i].view);
    double sum = 0;
    for (int k = 0; k < 4; ++k) {
      const double weight =
          static_cast<double>(taps.weight[k] * level.opacity()[texel * views.count() + taps.cell[k]]);
      if (!(weight > 0)) continue;
      sum += weight;
      const auto same =
          std::ranges::find_if(pair.views, [&](const auto& entry) { return entry.first == taps.cell[k]; });
      if (same == pair.views.end())
        pair.views.emplace_back(taps.cell[k], weight);
      else
        same->second += weight;
    }
    if (!(sum > 0 && l.z > 0 && pair.weight > 0)) continue;
    for (auto& [view, weight] : pair.views) weight /= sum;
    pairs.push_back(pair);
  }
  return pairs;
}

/// Mean of a table over the views, weighted by opacity; 1 without any.
double mean_of(std::span<const float> opacity, const std::vector<double>& table) {
  double sum = 0;
  double weight = 0;
  for (std::size_t v = 0; v < table.size(); ++v) {
    sum += static_cast<double>(opacity[v]) * table[v];
    weight += static_cast<double>(opacity[v]);
  }
  return sum > 0 ? sum / weight : 1;
}

void refit_texel(FabricLevel& level, const DirectionGrid& views, std::size_t texel,
                 const std::vector<DirectionPair>& directions, const SampleLevel& samples,
                 const FitOptions& options, int lights) {
  const std::size_t first = texel * directions.size();
  const auto pairs = pairs_of(level, views, texel, directions, &samples.alpha[first]);
  const int parameters = parameter_count(options.lobes);
  const int entries = options.view_table ? views.count() : 0;
  if (parameters + entries > std::min(static_cast<int>(pairs.size()), max_unknowns)) return;
  const auto opacity = level.opacity().subspan(texel * views.count(), entries);
  for (int c = 0; c < 3; ++c) {
    float* const lobes = &level.lobes()[(texel * 3 + c) * parameters];
    std::vector<double> values;
    // No lobe is brighter than the brightest pair, or than the lobes of the start, whose bounds were the
    // grids'.
    double peak = static_cast<double>(lobes[0]);
    for (const TexelPair& pair : pairs) {
      values.push_back(static_cast<double>(samples.radiance[first + pair.index][c]));
      peak = std::max(peak, values.back() / std::max(pair.cosine, 0.25));
    }
    for (int k = 1; k < parameters; k += 4) {
      const double longest =
          static_cast<double>(std::max({std::abs(lobes[k]), std::abs(lobes[k + 1]), std::abs(lobes[k + 2])}));
      peak = std::max(peak, positive_power(longest, std::max(1.0, static_cast<double>(lobes[k + 3]))));
    }
    if (!(peak > 0)) continue;
    for (double& value : values) value /= peak;
    std::vector<double> x(lobes, lobes + parameters);
    x[0] /= peak;
    for (int k = 1; k < parameters; k += 4) {
      // A lobe of size 0 has no direction to begin with, and stays dark.
      const double n = std::clamp(x[k + 3], LobeBounds().min_exponent, LobeBounds().max_exponent);
      for (int i = k; i < k + 3; ++i) x[i] = std::clamp(x[i] * std::pow(peak, -1 / n), -1.0, 1.0);
      x[k + 3] = std::log(n);
    }
    std::vector<double> table;
    for (int v = 0; v < entries; ++v)
      table.push_back(static_cast<double>(level.view_table()[texel * entries + v][c]));
    if (!solve(pairs, values, views, lights, options, x.data(), table)) continue;
    // Scales the table to a mean of 1, and the lobes by the inverse.
    const double mean = mean_of(opacity, table);
    lobes[0] = static_cast<float>(x[0] * mean * peak);
    for (int k = 1; k < parameters; k += 4) {
      const double n = std::exp(x[k + 3]);
      for (int i = k; i < k + 3; ++i) lobes[i] = static_cast<float>(x[i] * std::pow(mean * peak, 1 / n));
      lobes[k + 3] = static_cast<float>(n);
    }
    // An entry of a hole has no meaning, and nothing bounds it.
    for (int v = 0; v < entries; ++v)
      level.view_table()[texel * entries + v][c] = opacity[v] > 0 ? static_cast<float>(table[v] / mean) : 1;
  }
}

}  // namespace

void refit_to_pairs(Fabric& fabric, const PairSamples& measured, int lights, const FitOptions& options) {
  if (measured.pairs.empty()) return;
  FLAGS_minloglevel = google::GLOG_FATAL;  // Ceres prints nothing
  // Every pair as a view with one light.
  SampleLevel samples{.width = measured.width,
                      .height = measured.height,
                      .views = static_cast<int>(measured.pairs.size()),
                      .lights = 1};
  const std::size_t texels = samples.texels();
  samples.normal_sum.assign(texels, V3f(0));
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
