#include "fitter/lobe_fit.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>

#include "format/lafortune.h"

namespace selvedge {
namespace {

/// Residuals of all samples of one channel, then one ridge residual per C. One parameter block in the layout of
/// lafortune.h. Written with its derivatives, because log(base) serves both the power and its exponent.
/// Radiance is in units of `peak`: then |C| <= 1 bounds a lobe's peak for every exponent.
class ChannelCost : public ceres::CostFunction {
 public:
  ChannelCost(const TexelSamples& samples, int channel, const std::vector<double>& table, double peak, int lobes,
              double ridge)
      : samples_(samples), channel_(channel), table_(table), peak_(peak), lobes_(lobes), ridge_(ridge) {
    set_num_residuals(static_cast<int>(samples.samples.size()) + 3 * lobes);
    mutable_parameter_block_sizes()->push_back(parameter_count(lobes));
  }

  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override {
    const double* p = blocks[0];
    const int count = parameter_count(lobes_);
    double* jacobian = jacobians != nullptr ? jacobians[0] : nullptr;
    std::size_t row = 0;
    for (std::size_t v = 0; v < samples_.weight.size(); ++v) {
      const double scale = std::sqrt(samples_.weight[v]);
      const double factor = scale * table_[v];
      for (std::size_t i = samples_.first[v]; i < samples_.first[v + 1]; ++i, ++row) {
        const TexelSamples::Sample& s = samples_.samples[i];
        double* derivative = jacobian != nullptr ? jacobian + row * static_cast<std::size_t>(count) : nullptr;
        const double cosine = factor * s.cosine;
        double sum = p[0];
        if (derivative != nullptr) derivative[0] = cosine;
        for (int j = 0; j < lobes_; ++j) {
          const double* lobe = p + 1 + 4 * j;
          const double base = lobe[0] * s.product.x + lobe[1] * s.product.y + lobe[2] * s.product.z;
          double power = 0;
          double slope = 0;
          double of_exponent = 0;
          if (base > 0) {
            const double logarithm = std::log(base);
            power = std::exp(lobe[3] * logarithm);
            slope = lobe[3] * power / base;
            of_exponent = power * logarithm;
          }
          sum += power;
          if (derivative != nullptr) {
            double* d = derivative + 1 + 4 * j;
            d[0] = cosine * slope * s.product.x;
            d[1] = cosine * slope * s.product.y;
            d[2] = cosine * slope * s.product.z;
            d[3] = cosine * of_exponent;
          }
        }
        residuals[row] = cosine * sum - scale * s.radiance[channel_] / peak_;
        if (!std::isfinite(residuals[row])) return false;
      }
    }
    for (int j = 0; j < lobes_; ++j) {
      for (int k = 0; k < 3; ++k, ++row) {
        residuals[row] = ridge_ * p[1 + 4 * j + k];
        if (jacobian == nullptr) continue;
        double* derivative = jacobian + row * static_cast<std::size_t>(count);
        std::fill(derivative, derivative + count, 0.0);
        derivative[1 + 4 * j + k] = ridge_;
      }
    }
    return true;
  }

 private:
  const TexelSamples& samples_;
  int channel_;
  const std::vector<double>& table_;
  double peak_;
  int lobes_;
  double ridge_;
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
      const TexelSamples::Sample& s = samples.samples[i];
      const double model = table[v] * s.cosine;
      sums.model += samples.weight[v] * model * model;
      sums.cross += samples.weight[v] * model * s.radiance[channel];
      sums.energy += samples.weight[v] * s.radiance[channel] * s.radiance[channel];
    }
  }
  return sums;
}

}  // namespace

std::vector<double> start_parameters(int lobes, double scale) {
  std::vector<double> p(static_cast<std::size_t>(parameter_count(lobes)));
  p[0] = lobes > 0 ? 0.7 * scale : scale;
  for (int j = 0; j < lobes; ++j) {
    constexpr double exponent = 3;
    // The peak of the lobe, C^n, is a moderate share of the diffuse term.
    const double c = std::pow(0.5 * std::max(scale, 1e-12), 1 / exponent);
    const double sideways = j % 2 == 0 ? -0.6 : 0.6;
    const bool along_x = j % 2 == 0;
    double* lobe = &p[static_cast<std::size_t>(1 + 4 * j)];
    lobe[0] = c * sideways * (along_x ? 1.0 : 0.9);
    lobe[1] = c * sideways * (along_x ? 0.9 : 1.0);
    lobe[2] = c;
    lobe[3] = exponent * (1 + j / 2);
  }
  return p;
}

double peak_limit(const TexelSamples& samples, int channel, double headroom) {
  constexpr double least_cosine = 0.25;
  double largest = 0;
  for (std::size_t v = 0; v < samples.weight.size(); ++v) {
    if (samples.weight[v] == 0) continue;
    for (std::size_t i = samples.first[v]; i < samples.first[v + 1]; ++i) {
      const TexelSamples::Sample& s = samples.samples[i];
      largest = std::max(largest, s.radiance[channel] / std::max(s.cosine, least_cosine));
    }
  }
  return headroom * largest;
}

double fit_lobes(const TexelSamples& samples, int channel, const std::vector<double>& table,
                 double peak, const LobeFitOptions& options, std::vector<double>& parameters) {
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
    for (int k = 0; k < 3; ++k) lobe[k] = std::clamp(lobe[k] / std::pow(peak, 1 / lobe[3]), -1.0, 1.0);
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
