#include "fitter/lobe_fit.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>

#include "fitter/gram.h"
#include "format/lafortune.h"

namespace selvedge {
namespace {

/// All samples of one channel as few residuals. Least squares knows its rows [J | r] only through their inner
/// products; the triangular factor R of those has the same ones in parameter_count + 1 rows, and Ceres' work
/// per row, which was most of the time, is gone. The ridge on the C's joins the inner products.
///
/// One parameter block in the layout of lafortune.h. Radiance is in units of `peak`: then |C| <= 1 bounds a
/// lobe's peak for every exponent.
class ChannelCost : public ceres::CostFunction {
 public:
  ChannelCost(const TexelSamples& samples, int channel, const std::vector<double>& table, double peak,
              int lobes, double ridge)
      : samples_(samples), lobes_(lobes), ridge_(ridge) {
    set_num_residuals(parameter_count(lobes) + 1);
    mutable_parameter_block_sizes()->push_back(parameter_count(lobes));
    factor_.assign(samples.size(), 0);
    target_.assign(samples.size(), 0);
    const std::vector<float>& radiance = samples.radiance[static_cast<std::size_t>(channel)];
    for (std::size_t v = 0; v < samples.weight.size(); ++v) {
      const double root = std::sqrt(samples.weight[v]);
      for (std::size_t i = samples.first[v]; i < samples.first[v + 1]; ++i) {
        factor_[i] = static_cast<float>(root * table[v]) * samples.cosine[i];
        target_[i] = static_cast<float>(root * static_cast<double>(radiance[i]) / peak);
      }
    }
    columns_.assign(static_cast<std::size_t>(parameter_count(lobes)) + 1, std::vector<float>(samples.size()));
    columns_.front() = factor_;
  }

  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override {
    const double* p = blocks[0];
    const auto count = static_cast<std::size_t>(parameter_count(lobes_));
    double* jacobian = jacobians != nullptr ? jacobians[0] : nullptr;
    std::vector<float>& residual = columns_.back();
    for (std::size_t i = 0; i < residual.size(); ++i) {
      residual[i] = factor_[i] * static_cast<float>(p[0]) - target_[i];
    }
    for (int j = 0; j < lobes_; ++j) {
      const double* lobe = p + 1 + 4 * j;
      terms_.compute(samples_, lobe);
      for (std::size_t i = 0; i < residual.size(); ++i) residual[i] += factor_[i] * terms_.power[i];
      if (jacobian != nullptr)
        differentiate(static_cast<float>(lobe[3]), &columns_[static_cast<std::size_t>(1 + 4 * j)]);
    }
    double ridge_norm = 0;
    for (std::size_t k = 1; k < count; ++k) {
      if (k % 4 != 0) ridge_norm += ridge_ * ridge_ * p[k] * p[k];
    }
    std::fill_n(residuals, count + 1, 0.0);
    if (jacobian == nullptr) {
      residuals[count] = std::sqrt(squared_norm(residual) + ridge_norm);
      return true;
    }
    inner_products(columns_, gram_);
    for (std::size_t k = 1; k < count; ++k) {
      if (k % 4 == 0) continue;  // exponents
      gram_[k * (count + 1) + k] += ridge_ * ridge_;
      gram_[k * (count + 1) + count] += ridge_ * ridge_ * p[k];
    }
    gram_[count * (count + 1) + count] += ridge_norm;
    const double norm = gram_[count * (count + 1) + count];
    cholesky(gram_, count + 1);
    double explained = 0;
    for (std::size_t row = 0; row < count; ++row) {
      residuals[row] = gram_[row * (count + 1) + count];
      explained += residuals[row] * residuals[row];
      std::copy_n(&gram_[row * (count + 1)], count, jacobian + row * count);
    }
    // The norm to full precision, so that steps are judged by the same cost with and without derivatives.
    residuals[count] = std::sqrt(std::max(0.0, norm - explained));
    std::fill_n(jacobian + count * count, count, 0.0);
    return true;
  }

 private:
  /// Fills the four columns of one lobe from terms_.
  void differentiate(float exponent, std::vector<float>* column) const {
    for (std::size_t i = 0; i < factor_.size(); ++i) {
      const float power = factor_[i] * terms_.power[i];
      const float slope = terms_.power[i] > 0 ? exponent * power / terms_.base[i] : 0.0F;
      column[0][i] = slope * samples_.x[i];
      column[1][i] = slope * samples_.y[i];
      column[2][i] = slope * samples_.z[i];
      column[3][i] = power * terms_.logarithm[i];
    }
  }

  const TexelSamples& samples_;
  int lobes_;
  double ridge_;
  std::vector<float> factor_;  // sqrt(weight) T cosine
  std::vector<float> target_;  // sqrt(weight) radiance / peak
  // Ceres calls from one thread; the buffers only save allocations.
  mutable LobeTerms terms_;
  mutable Columns columns_;  // of the parameters, then the residual
  mutable std::vector<double> gram_;
};

/// Weighted sums over the samples with no lobes: everything a diffuse term needs.
struct DiffuseSums {
  double model = 0;   // sum w (T cos)^2
  double cross = 0;   // sum w T cos r
  double energy = 0;  // sum w r^2
};

DiffuseSums diffuse_sums(const TexelSamples& samples, int channel, const std::vector<double>& table) {
  DiffuseSums sums;
  for (std::size_t v = 0; v < samples.weight.size(); ++v) {
    for (std::size_t i = samples.first[v]; i < samples.first[v + 1]; ++i) {
      const double model = table[v] * static_cast<double>(samples.cosine[i]);
      const auto radiance = static_cast<double>(samples.radiance[static_cast<std::size_t>(channel)][i]);
      sums.model += samples.weight[v] * model * model;
      sums.cross += samples.weight[v] * model * radiance;
      sums.energy += samples.weight[v] * radiance * radiance;
    }
  }
  return sums;
}

}  // namespace

std::vector<double> start_parameters(int lobes, double scale) {
  std::vector<double> p(static_cast<std::size_t>(parameter_count(lobes)));
  p[0] = lobes > 0 ? 0.7 * scale : scale;
  for (int j = 0; j < lobes; ++j) {
    const int octave = j / 2;
    const double exponent = 3.0 * (1 + octave);
    // The peak of the lobe, C^n, is a moderate share of the diffuse term.
    const double c = std::pow(0.5 * std::max(scale, 1e-12), 1 / exponent);
    const double sideways = j % 2 == 0 ? -0.6 : 0.6;
    const bool along_x = j % 2 == 0;
    double* lobe = &p[static_cast<std::size_t>(1 + 4 * j)];
    lobe[0] = c * sideways * (along_x ? 1.0 : 0.9);
    lobe[1] = c * sideways * (along_x ? 0.9 : 1.0);
    lobe[2] = c;
    lobe[3] = exponent;
  }
  return p;
}

double peak_limit(const TexelSamples& samples, int channel) {
  constexpr float least_cosine = 0.25F;
  float largest = 0;
  const std::vector<float>& radiance = samples.radiance[static_cast<std::size_t>(channel)];
  for (std::size_t i = 0; i < samples.size(); ++i) {
    largest = std::max(largest, radiance[i] / std::max(samples.cosine[i], least_cosine));
  }
  return static_cast<double>(largest);
}

double fit_lobes(const TexelSamples& samples, int channel, const std::vector<double>& table, double peak,
                 const LobeFitOptions& options, std::vector<double>& parameters) {
  const DiffuseSums sums = diffuse_sums(samples, channel, table);
  const auto error_of_diffuse = [&](double rho) {
    return std::max(0.0, sums.energy - 2 * rho * sums.cross + rho * rho * sums.model);
  };
  const double diffuse = sums.model > 0 ? sums.cross / sums.model : 0.0;
  // Nothing to see, nothing left to explain, or no lobes wanted: the diffuse term alone, in closed form.
  if (options.lobes == 0 || sums.model <= 0 || error_of_diffuse(diffuse) <= 1e-6 * sums.energy) {
    std::fill(parameters.begin(), parameters.end(), 0.0);
    for (int j = 0; j < options.lobes; ++j) parameters[static_cast<std::size_t>(4 + 4 * j)] = 1;
    parameters[0] = diffuse;
    return error_of_diffuse(diffuse);
  }

  // Into units of `peak`, and within the bounds.
  parameters[0] = std::max(0.0, parameters[0] / peak);
  for (int j = 0; j < options.lobes; ++j) {
    double* lobe = &parameters[static_cast<std::size_t>(1 + 4 * j)];
    lobe[3] = std::clamp(lobe[3], 1.0, options.max_exponent);
    for (int k = 0; k < 3; ++k) lobe[k] /= std::pow(peak, 1 / lobe[3]);
    // Shortened as a whole: the lobe keeps its direction.
    const double longest = std::max({std::abs(lobe[0]), std::abs(lobe[1]), std::abs(lobe[2]), 1.0});
    for (int k = 0; k < 3; ++k) lobe[k] /= longest;
  }

  const double ridge = std::sqrt(1e-6 * sums.energy) / peak;
  ChannelCost cost(samples, channel, table, peak, options.lobes, ridge);
  ceres::Problem::Options problem_options;
  problem_options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(problem_options);
  problem.AddResidualBlock(&cost, nullptr, parameters.data());
  problem.SetParameterLowerBound(parameters.data(), 0, 0);
  for (int j = 0; j < options.lobes; ++j) {
    for (int k = 1; k <= 3; ++k) {
      problem.SetParameterLowerBound(parameters.data(), 4 * j + k, -1);
      problem.SetParameterUpperBound(parameters.data(), 4 * j + k, 1);
    }
    problem.SetParameterLowerBound(parameters.data(), 4 + 4 * j, 1);
    problem.SetParameterUpperBound(parameters.data(), 4 + 4 * j, options.max_exponent);
  }
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  solver.max_num_iterations = options.max_iterations;
  solver.function_tolerance = 1e-5;
  solver.num_threads = 1;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);

  double ridge_error = 0;
  parameters[0] *= peak;
  for (int j = 0; j < options.lobes; ++j) {
    double* lobe = &parameters[static_cast<std::size_t>(1 + 4 * j)];
    for (int k = 0; k < 3; ++k) {
      ridge_error += ridge * ridge * lobe[k] * lobe[k];
      lobe[k] *= std::pow(peak, 1 / lobe[3]);
    }
  }
  return std::max(0.0, 2 * summary.final_cost - ridge_error) * peak * peak;
}

}  // namespace selvedge
