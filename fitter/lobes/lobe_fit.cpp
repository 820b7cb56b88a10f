#include "fitter/lobes/lobe_fit.h"

#include <algorithm>
#include <cmath>

#include "format/fabric/lafortune.h"

namespace selvedge {
namespace {

/// Alternations between sizes and table per evaluation; cheap compared with the sums over the samples.
constexpr int turns = 3;

/// Whether an unknown of the normal equations cannot move: it is at a bound and descent would move it
/// outwards, or it has no effect.
bool is_fixed(const LobeBounds& bounds, const ChannelState& state, std::size_t unknown, double gradient,
              double curvature) {
  if (!(curvature > 0)) return true;
  if (unknown == 0) return state.sizes[0] <= 0 && gradient >= 0;
  const std::size_t lobe = (unknown - 1) / LobeStep::unknowns;
  return is_at_bound((unknown - 1) % LobeStep::unknowns, gradient, bounds, state.shapes[lobe],
                     state.sizes[lobe + 1]);
}

/// Searches from several starts for a few iterations, and continues the best of them to the end. Searches for
/// more than two lobes start from the best result with one lobe less, because with more lobes the dictionary
/// finds fewer of the good minima.
void search_lobes(ChannelProblem& problem, StartSearch& search, int channel, int lobes,
                  const FitOptions& options, ChannelState& best) {
  constexpr int start_iterations = 6;
  constexpr int max_dictionary_lobes = 2;
  std::vector<ChannelState> states;
  if (lobes > max_dictionary_lobes) {
    search_lobes(problem, search, channel, lobes - 1, options, best);
    states = StartSearch::with_added_lobe(problem, best, options.starts);
  } else {
    states = search.starts(channel, lobes, options.starts);
  }
  for (ChannelState& state : states) minimise(problem, state, 1e-3, states.size() > 1 ? start_iterations : 1);
  const auto cheaper = [](const ChannelState& a, const ChannelState& b) { return a.cost < b.cost; };
  std::ranges::stable_sort(states, cheaper);
  states.resize(std::min<std::size_t>(states.size(), options.finalists));
  best = states.front();
  for (ChannelState& state : states) {
    minimise(problem, state, options.tolerance, options.max_iterations);
    if (!cheaper(best, state)) best = state;
  }
}

}  // namespace

ChannelFit to_channel_fit(const TexelSamples& samples, int channel, const ChannelState& state) {
  const double scale = samples.scale[channel];
  ChannelFit fit;
  fit.cost = state.cost * scale * scale;
  fit.table = state.table;
  // Scales T to mean 1, and lobes by the inverse: their product is unchanged.
  double sum = 0;
  double weight = 0;
  for (std::size_t v = 0; v < samples.view_count; ++v) {
    sum += samples.view_weights[v] * state.table[v];
    weight += samples.view_weights[v];
  }
  const double mean = sum > 0 ? sum / weight : 1;
  for (double& t : fit.table) t /= mean;
  fit.parameters.push_back(state.sizes[0] * mean * scale);
  for (std::size_t j = 0; j < state.shapes.size(); ++j) {
    const LobeShape& shape = state.shapes[j];
    const double size = state.sizes[j + 1] * mean * scale;
    const double c = size > 0 ? std::pow(size, 1 / shape.exponent) : 0;
    for (const double d : shape.direction) fit.parameters.push_back(c * d);
    fit.parameters.push_back(shape.exponent);
  }
  return fit;
}

void minimise(ChannelProblem& problem, ChannelState& state, double tolerance, int max_evaluations) {
  problem.evaluate(state, turns);
  int evaluations = 1;
  bool converged = state.shapes.empty();
  NormalEquations equations;
  double lambda = 1e-3;
  bool moved = true;
  while (!converged && evaluations < max_evaluations) {
    if (moved) equations = problem.normal_equations(state);
    const std::vector<double>& gradient = equations.gradient;
    const std::size_t unknowns = gradient.size();
    std::vector<double> damped = equations.matrix;
    std::vector<double> step(unknowns);
    std::vector<char> fixed(unknowns);
    for (std::size_t u = 0; u < unknowns; ++u) {
      const double curvature = equations.matrix[u * unknowns + u];
      fixed[u] = is_fixed(problem.bounds(), state, u, gradient[u], curvature) ? 1 : 0;
      damped[u * unknowns + u] += lambda * curvature + 1e-14 * problem.weighted_squared_radiance();
      step[u] = -gradient[u];
    }
    moved = false;
    const bool solved = solve_symmetric(damped, step, fixed);
    double expected = 0;
    for (std::size_t u = 0; solved && u < unknowns; ++u)
      expected += step[u] * (lambda * equations.matrix[u * unknowns + u] * step[u] - gradient[u]);
    if (solved && expected <= 0.5 * tolerance * state.cost) return;
    double gain = 0;
    ChannelState trial;
    if (solved && std::isfinite(expected)) {
      trial = state;
      trial.sizes[0] = std::max(0.0, trial.sizes[0] + step[0]);
      for (std::size_t j = 0; j < trial.shapes.size(); ++j)
        move_lobe(LobeStep::from_values(&step[1 + LobeStep::unknowns * j]), problem.bounds(), trial.shapes[j],
                  trial.sizes[j + 1]);
      problem.evaluate(trial, turns);
      ++evaluations;
      gain = state.cost - trial.cost;
    }
    if (gain > 0) {
      moved = true;
      converged = gain <= tolerance * state.cost;
      std::swap(state, trial);
      const double ratio = gain / expected;
      lambda = std::max(1e-9, lambda * (ratio > 0.75 ? 0.2 : ratio > 0.25 ? 0.5 : 2));
    } else {
      lambda = std::max(lambda * 8, 1e-3);
      // Steps so short have no effect in single precision.
      converged = lambda > 1e8;
    }
  }
}

std::array<ChannelFit, 3> fit_texel(const TexelSamples& samples, const FitOptions& options) {
  std::array<ChannelFit, 3> fits;
  thread_local StartSearch search;
  search.set_samples(samples);
  for (int c = 0; c < 3; ++c) {
    ChannelProblem problem(samples, c, options);
    ChannelState best;  // with lobes of size 0
    best.shapes.resize(options.lobes);
    best.sizes.assign(options.lobes + 1, 0);
    best.table.assign(samples.view_count, 1);
    problem.evaluate(best, turns);
    if (options.lobes > 0 && best.error > 1e-6 * problem.weighted_squared_radiance())
      search_lobes(problem, search, c, options.lobes, options, best);
    fits[c] = to_channel_fit(samples, c, best);
  }
  return fits;
}

}  // namespace selvedge
