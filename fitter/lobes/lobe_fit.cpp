#include "fitter/lobes/lobe_fit.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "fitter/lobes/lobe_starts.h"
#include "fitter/solve/small_solve.h"
#include "format/fabric/lafortune.h"

namespace selvedge {
namespace {

/// Of sizes and table in a state that is to be judged: more turns cost little beside the samples.
constexpr int turns = 3;

/// The unknowns of ChannelProblem::normal_equations.
enum class Unknown { rho, size, direction, exponent };

Unknown kind_of(std::size_t u) {
  if (u == 0) return Unknown::rho;
  return u % 4 == 1 ? Unknown::size : u % 4 == 0 ? Unknown::exponent : Unknown::direction;
}

/// Whether a step along an unknown is impossible: at a bound and pushed outwards, or without effect.
bool is_held(const ChannelProblem& problem, const ChannelState& state, std::size_t u, double gradient,
             double curvature) {
  if (!(curvature > 0)) return true;
  const std::size_t lobe = u == 0 ? 0 : (u - 1) / 4;
  switch (kind_of(u)) {
    case Unknown::rho:
      return state.sizes[0] <= 0 && gradient >= 0;
    case Unknown::size: {
      const double size = state.sizes[lobe + 1];
      return (size <= 0 && gradient >= 0) || (size >= problem.peak() && gradient <= 0);
    }
    case Unknown::exponent: {
      const double n = state.shapes[lobe].exponent;
      return (n <= problem.options().min_exponent && gradient >= 0) ||
             (n >= problem.options().max_exponent && gradient <= 0);
    }
    default:
      return false;
  }
}

/// The state a step away, within the bounds.
void take_step(const ChannelProblem& problem, const std::vector<double>& step, ChannelState& state) {
  const ChannelOptions& options = problem.options();
  state.sizes[0] = std::max(0.0, state.sizes[0] + step[0]);
  for (std::size_t j = 0; j < state.shapes.size(); ++j) {
    LobeShape& shape = state.shapes[j];
    const double* s = &step[1 + 4 * j];
    const std::size_t kept = longest(shape);
    shape.direction[(kept + 1) % 3] += s[1];
    shape.direction[(kept + 2) % 3] += s[2];
    constexpr double furthest = 1.5;
    shape.exponent = std::clamp(shape.exponent * std::exp(std::clamp(s[3], -furthest, furthest)),
                                options.min_exponent, options.max_exponent);
    // The direction's length goes into the size.
    const double length = std::abs(shape.direction[longest(shape)]);
    for (double& d : shape.direction) d /= length;
    const double size = (state.sizes[j + 1] + s[0]) * std::pow(length, shape.exponent);
    state.sizes[j + 1] = std::clamp(size, 0.0, problem.peak());
  }
}

/// Diffuse alone, in closed form: where nothing else is left to explain.
ChannelState diffuse_state(const TexelSamples& samples, int lobes) {
  ChannelState state;
  state.shapes.resize(lobes);
  state.sizes.assign(static_cast<std::size_t>(lobes) + 1, 0);
  state.table.assign(samples.views, 1);
  return state;
}

}  // namespace

ChannelFit channel_fit(const TexelSamples& samples, int channel, const ChannelState& state,
                       const ChannelProblem& problem) {
  const double scale = samples.scale[channel];
  ChannelFit fit;
  fit.error = state.error * scale * scale;
  fit.cost = state.cost * scale * scale;
  fit.energy = problem.energy() * scale * scale;
  fit.table = state.table;
  // T and S to mean 1, lobes by the inverse: their product is unchanged.
  double sum = 0;
  double weight = 0;
  for (std::size_t v = 0; v < samples.views; ++v) {
    sum += samples.weight[v] * state.table[v];
    weight += samples.weight[v];
  }
  double mean = sum > 0 ? sum / weight : 1;
  for (double& t : fit.table) t /= mean;
  fit.light_table = state.light_table;
  const double of_lights = std::accumulate(fit.light_table.begin(), fit.light_table.end(), 0.0) /
                           std::max(1.0, static_cast<double>(fit.light_table.size()));
  if (of_lights > 0) {
    for (double& s : fit.light_table) s /= of_lights;
    mean *= of_lights;
  }
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

int minimise(ChannelProblem& problem, ChannelState& state, double tolerance, int max_iterations,
             bool& converged) {
  const std::size_t unknowns = 1 + 4 * state.shapes.size();
  problem.evaluate(state, turns);
  converged = state.shapes.empty();
  std::vector<double> matrix;
  std::vector<double> gradient;
  ChannelState trial;
  int iterations = 1;
  double lambda = 1e-3;
  bool moved = true;
  while (!converged && iterations < max_iterations) {
    if (moved) problem.normal_equations(state, matrix, gradient);
    std::vector<double> damped = matrix;
    std::vector<double> step(unknowns);
    std::vector<char> held(unknowns);
    for (std::size_t u = 0; u < unknowns; ++u) {
      const double curvature = matrix[u * unknowns + u];
      held[u] = is_held(problem, state, u, gradient[u], curvature) ? 1 : 0;
      damped[u * unknowns + u] += lambda * curvature + 1e-14 * problem.energy();
      step[u] = -gradient[u];
    }
    moved = false;
    const bool solved = solve_symmetric(damped, step, held);
    double expected = 0;
    for (std::size_t u = 0; solved && u < unknowns; ++u) {
      expected += step[u] * (lambda * matrix[u * unknowns + u] * step[u] - gradient[u]);
    }
    if (solved && expected <= 0.5 * tolerance * state.cost) {
      converged = true;
      break;
    }
    double gain = 0;
    if (solved && std::isfinite(expected)) {
      trial = state;
      take_step(problem, step, trial);
      problem.evaluate(trial, turns);
      ++iterations;
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
      // Steps this short change nothing that single precision shows.
      converged = lambda > 1e8;
    }
  }
  return iterations;
}

namespace {

/// Of a channel: from several starts, all of which go a little way and the best of them to the end. More than
/// two lobes begin with the best of one less: with each lobe more the dictionary finds fewer of the good
/// minima.
ChannelState best_state(ChannelProblem& problem, StartSearch& search, int channel, int lobes,
                        const LobeFitOptions& options, int& iterations, bool& converged) {
  constexpr int first_leg = 6;
  constexpr int found_by_dictionary = 2;
  const auto count = static_cast<std::size_t>(options.starts);
  std::vector<ChannelState> states;
  if (lobes > found_by_dictionary) {
    const ChannelState fewer =
        best_state(problem, search, channel, lobes - 1, options, iterations, converged);
    states = StartSearch::grown(problem, fewer, count);
  } else {
    states = search.starts(channel, lobes, count);
  }
  for (ChannelState& state : states) {
    iterations += minimise(problem, state, 1e-3, states.size() > 1 ? first_leg : 1, converged);
  }
  const auto cheaper = [](const ChannelState& a, const ChannelState& b) { return a.cost < b.cost; };
  std::stable_sort(states.begin(), states.end(), cheaper);
  states.resize(std::min(states.size(), static_cast<std::size_t>(options.finalists)));
  ChannelState best = states.front();
  for (ChannelState& state : states) {
    bool done = false;
    iterations += minimise(problem, state, options.tolerance, options.max_iterations, done);
    if (cheaper(best, state)) continue;
    best = state;
    converged = done;
  }
  return best;
}

}  // namespace

namespace {

std::vector<std::uint32_t> all_lights(const TexelSamples& samples) {
  std::vector<std::uint32_t> lights(samples.lights.size());
  std::iota(lights.begin(), lights.end(), 0U);
  return lights;
}

/// The light table and all else by turns, from a state that is good with S = 1. A turn goes further than the
/// minimum over the light table alone, as the minimum over all lies beyond it, as long as that pays.
void fit_lights(ChannelProblem& problem, ChannelState& state, const LobeFitOptions& options, int& iterations,
                bool& converged) {
  constexpr int max_rounds = 60;
  converged = false;
  constexpr double longest_step = 4;
  double step = 1;
  for (int round = 0; round < max_rounds && !converged; ++round) {
    ChannelState next = state;
    problem.fit_light_table(next);
    for (std::size_t l = 0; l < state.light_table.size(); ++l) {
      const double from = state.light_table[l];
      next.light_table[l] = std::max(0.0, from + step * (next.light_table[l] - from));
    }
    bool done = false;
    iterations += minimise(problem, next, options.tolerance, options.max_iterations, done);
    const double gain = state.cost - next.cost;
    // The first round has a penalty more than the state before it.
    if (round == 0 || gain > 0) state = std::move(next);
    converged = done && round > 0 && step == 1 && gain <= options.tolerance * state.cost;
    step = round == 0 || gain > options.tolerance * state.cost ? std::min(1.5 * step, longest_step) : 1;
  }
}

}  // namespace

ChannelState state_of(const TexelSamples& samples, int channel, const ChannelFit& fit) {
  const double scale = samples.scale[channel];
  ChannelState state;
  state.sizes.push_back(fit.parameters[0] / scale);
  for (std::size_t i = 1; i + 3 < fit.parameters.size(); i += 4) {
    const double* p = &fit.parameters[i];
    const double c = std::max({std::abs(p[0]), std::abs(p[1]), std::abs(p[2])});
    LobeShape shape;
    shape.exponent = p[3];
    if (c > 0) shape.direction = {p[0] / c, p[1] / c, p[2] / c};
    state.shapes.push_back(shape);
    state.sizes.push_back(c > 0 ? std::pow(c, p[3]) / scale : 0);
  }
  state.table = fit.table;
  state.light_table = fit.light_table;
  return state;
}

std::array<ChannelFit, 3> refit_texel(const TexelSamples& samples, const std::array<ChannelFit, 3>& near,
                                      const LobeFitOptions& options) {
  const std::vector<std::uint32_t> lights = all_lights(samples);
  std::array<ChannelFit, 3> fits;
  for (int c = 0; c < 3; ++c) {
    ChannelFit& fit = fits[c];
    ChannelProblem problem(samples, c, lights, options.channel);
    ChannelState state = state_of(samples, c, near[c]);
    bool converged = true;
    int iterations = minimise(problem, state, options.tolerance, options.max_iterations, converged);
    if (options.channel.light_table) fit_lights(problem, state, options, iterations, converged);
    fit = channel_fit(samples, c, state, problem);
    fit.iterations = iterations;
    fit.converged = converged;
  }
  return fits;
}

std::array<ChannelFit, 3> fit_texel(const TexelSamples& samples, const LobeFitOptions& options) {
  const std::vector<std::uint32_t> lights = all_lights(samples);
  std::array<ChannelFit, 3> fits;
  StartSearch search(samples);
  for (int c = 0; c < 3; ++c) {
    ChannelProblem problem(samples, c, lights, options.channel);
    ChannelState best = diffuse_state(samples, options.lobes);
    problem.evaluate(best, turns);
    int iterations = 1;
    bool converged = true;
    if (options.lobes > 0 && best.error > 1e-6 * problem.energy()) {
      best = best_state(problem, search, c, options.lobes, options, iterations, converged);
    }
    if (options.channel.light_table) fit_lights(problem, best, options, iterations, converged);
    ChannelFit& fit = fits[c];
    fit = channel_fit(samples, c, best, problem);
    fit.iterations = iterations;
    fit.converged = converged;
  }
  return fits;
}

}  // namespace selvedge
