#include "tests/fitter/ceres_reference.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>

#include "fitter/lobes/lobe_starts.h"
#include "format/fabric/lafortune.h"

namespace selvedge::test {
namespace {

/// Radiance and T are in units of the channel's peak: then |C| <= 1 bounds a lobe's peak for every exponent.
struct SampleResidual {
  V3d light;
  V3d view;
  double weight;  ///< root of the view's opacity
  double table;
  double radiance;
  int lobes;

  template <class T>
  bool operator()(T const* const* p, T* residual) const {
    residual[0] = weight * (table * lafortune(p[0], lobes, &light.x, &view.x) - radiance);
    return true;
  }
};

/// The penalty on a lobe's size, which is max |C|^n.
struct RidgeResidual {
  double root;
  int lobe;

  template <class T>
  bool operator()(T const* const* p, T* residual) const {
    using std::abs;
    using std::pow;
    const T* c = p[0] + 1 + 4 * lobe;
    T largest(1e-30);
    for (int k = 0; k < 3; ++k) {
      if (abs(c[k]) > largest) largest = abs(c[k]);
    }
    residual[0] = root * pow(largest, c[3]);
    return true;
  }
};

template <class Functor>
ceres::CostFunction* differentiated(const Functor& functor, int parameters) {
  constexpr int stride = 9;  // of parameters differentiated at a time: all of two lobes
  auto* cost = new ceres::DynamicAutoDiffCostFunction<Functor, stride>(new Functor(functor));
  cost->AddParameterBlock(parameters);
  cost->SetNumResiduals(1);
  return cost;
}

std::vector<double> parameters_of(const ChannelState& state, double peak) {
  std::vector<double> p{state.sizes[0] / peak};
  for (std::size_t j = 0; j < state.shapes.size(); ++j) {
    const double c =
        std::pow(std::max(state.sizes[j + 1], 1e-12 * peak) / peak, 1 / state.shapes[j].exponent);
    for (const double d : state.shapes[j].direction) p.push_back(c * d);
    p.push_back(state.shapes[j].exponent);
  }
  return p;
}

void read_parameters(const std::vector<double>& p, double peak, ChannelState& state) {
  state.sizes[0] = p[0] * peak;
  for (std::size_t j = 0; j < state.shapes.size(); ++j) {
    const double* c = &p[1 + 4 * j];
    const double largest = std::max({std::abs(c[0]), std::abs(c[1]), std::abs(c[2])});
    state.shapes[j].exponent = c[3];
    state.sizes[j + 1] = std::pow(largest, c[3]) * peak;
    for (std::size_t k = 0; k < 3 && largest > 0; ++k) state.shapes[j].direction[k] = c[k] / largest;
  }
}

class PlainFit {
 public:
  PlainFit(const TexelSamples& samples, int channel, const LobeFitOptions& options)
      : samples_(samples),
        channel_(static_cast<std::size_t>(channel)),
        options_(options),
        problem_(samples, channel, options.channel) {}

  ChannelProblem& problem() { return problem_; }

  /// One turn of lobes and table; returns Ceres' iterations.
  int turn(ChannelState& state, double tolerance, int max_iterations) {
    const int iterations = solve_lobes(state, tolerance, max_iterations);
    if (options_.channel.view_table) solve_table(state);
    problem_.evaluate(state, 0);
    return iterations;
  }

 private:
  V3d view(std::size_t v) const {
    return V3d(V3f(samples_.view[0][v], samples_.view[1][v], samples_.view[2][v]));
  }

  int solve_lobes(ChannelState& state, double tolerance, int max_iterations) {
    const int lobes = options_.lobes;
    const int count = parameter_count(lobes);
    const double peak = problem_.peak();
    std::vector<double> p = parameters_of(state, peak);
    ceres::Problem problem;
    problem.AddParameterBlock(p.data(), count);
    for (std::size_t l = 0; l < samples_.lights.size(); ++l) {
      for (std::size_t v = 0; v < samples_.views; ++v) {
        if (samples_.weight[v] <= 0) continue;
        const SampleResidual residual{
            V3d(samples_.lights[l]),
            view(v),
            std::sqrt(samples_.weight[v]),
            state.table[v],
            static_cast<double>(samples_.radiance[channel_][l * samples_.stride() + v]) / peak,
            lobes};
        problem.AddResidualBlock(differentiated(residual, count), nullptr, p.data());
      }
    }
    const double ridge = std::sqrt(options_.channel.ridge * problem_.energy()) / peak;
    problem.SetParameterLowerBound(p.data(), 0, 0);
    for (int j = 0; j < lobes; ++j) {
      problem.AddResidualBlock(differentiated(RidgeResidual{ridge, j}, count), nullptr, p.data());
      for (int k = 1; k <= 3; ++k) {
        problem.SetParameterLowerBound(p.data(), 4 * j + k, -1);
        problem.SetParameterUpperBound(p.data(), 4 * j + k, 1);
      }
      problem.SetParameterLowerBound(p.data(), 4 * j + 4, options_.channel.min_exponent);
      problem.SetParameterUpperBound(p.data(), 4 * j + 4, options_.channel.max_exponent);
    }
    ceres::Solver::Options solver;
    solver.linear_solver_type = ceres::DENSE_QR;
    solver.max_num_iterations = max_iterations;
    solver.function_tolerance = tolerance;
    solver.num_threads = 1;
    solver.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem, &summary);
    read_parameters(p, peak, state);
    return static_cast<int>(summary.iterations.size());
  }

  void solve_table(ChannelState& state) {
    const std::vector<double> p = parameters_of(state, 1);
    std::vector<double> square(samples_.views, 0);
    std::vector<double> cross(samples_.views, 0);
    double weight = 0;
    for (std::size_t v = 0; v < samples_.views; ++v) {
      weight += samples_.weight[v];
      const V3d to_view = view(v);
      for (std::size_t l = 0; l < samples_.lights.size(); ++l) {
        const V3d light(samples_.lights[l]);
        const double g = lafortune(p.data(), options_.lobes, &light.x, &to_view.x);
        square[v] += samples_.weight[v] * g * g;
        cross[v] += samples_.weight[v] * g *
                    static_cast<double>(samples_.radiance[channel_][l * samples_.stride() + v]);
      }
    }
    const double unit = weight > 0 ? problem_.energy() / weight : 0;
    DirectionTableSystem system(samples_.views, samples_.grid, options_.channel.table.damping * unit,
                                options_.channel.table.smoothness * unit);
    system.factor(square.data());
    system.solve(cross.data(), state.table.data());
  }

  const TexelSamples& samples_;
  std::size_t channel_;
  LobeFitOptions options_;
  ChannelProblem problem_;
};

}  // namespace

std::array<ChannelFit, 3> fit_texel_plainly(const TexelSamples& samples, const LobeFitOptions& options) {
  std::array<ChannelFit, 3> fits;
  StartSearch search(samples);
  for (int c = 0; c < 3; ++c) {
    PlainFit plain(samples, c, options);
    std::vector<ChannelState> states =
        search.starts(c, options.lobes, static_cast<std::size_t>(options.starts));
    int iterations = 0;
    for (ChannelState& state : states) iterations += plain.turn(state, 1e-3, 6);
    ChannelState best =
        *std::min_element(states.begin(), states.end(),
                          [](const ChannelState& a, const ChannelState& b) { return a.cost < b.cost; });
    bool converged = false;
    while (!converged && iterations < options.max_iterations * 10) {
      ChannelState next = best;
      iterations += plain.turn(next, options.tolerance, options.max_iterations);
      converged = best.cost - next.cost <= options.tolerance * best.cost;
      if (next.cost < best.cost) best = next;
    }
    ChannelFit& fit = fits[c];
    fit = channel_fit(samples, c, best, plain.problem());
    fit.iterations = iterations;
    fit.converged = converged;
  }
  return fits;
}

}  // namespace selvedge::test
