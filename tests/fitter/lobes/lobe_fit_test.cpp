#include "fitter/lobes/lobe_fit.h"

#include <doctest/doctest.h>

#include <cmath>

#include "format/base/random.h"
#include "format/fabric/fabric.h"

using namespace selvedge;

namespace {

/// A texel of rough relief: a valley's shadow that turns with the light, gloss, noise. No sum of two lobes.
TexelSamples rough_texel(int seed, const DirectionGrid& grid) {
  const std::vector<V3f> directions = cell_directions(grid);
  Random random(static_cast<std::uint64_t>(seed));
  const V3f tilt =
      V3f(static_cast<float>(random.uniform() - 0.5), static_cast<float>(random.uniform() - 0.5), 1)
          .normalized();
  std::vector<float> alpha;
  std::vector<V3f> radiance;
  for (const V3f& v : directions) {
    alpha.push_back(random.uniform() < 0.1 ? 0.0F : 1.0F);
    for (const V3f& l : directions) {
      const float lit = std::max(0.0F, l.dot(tilt)) * (l.x > 0.4F ? 0.3F : 1.0F);
      const float gloss = std::pow(std::max(0.0F, (l + v).normalized().dot(tilt)), 30.0F);
      const auto noise = static_cast<float>(1 + 0.1 * random.uniform());
      radiance.push_back(V3f(0.3F, 0.2F, 0.1F) * (lit * noise * (0.4F + v.z)) + V3f(0.2F) * (gloss * lit));
    }
  }
  return gather_texel(alpha.data(), radiance.data(), {directions, directions, grid}, {0, 0, 1}, {1, 0, 0});
}

/// The cost of a state with one of its unknowns moved and the table at its best.
double cost_at(ChannelProblem& problem, ChannelState state, std::size_t unknown, double by) {
  const std::size_t lobe = unknown == 0 ? 0 : (unknown - 1) / 4;
  const std::size_t kept = unknown == 0 ? 0 : longest_component(state.shapes[lobe]);
  switch (unknown == 0 ? 4 : (unknown - 1) % 4) {
    case 4:
      state.sizes[0] += by;
      break;
    case 0:
      state.sizes[lobe + 1] += by;
      break;
    case 1:
      state.shapes[lobe].direction[(kept + 1) % 3] += by;
      break;
    case 2:
      state.shapes[lobe].direction[(kept + 2) % 3] += by;
      break;
    default:
      state.shapes[lobe].exponent *= std::exp(by);
      break;
  }
  problem.evaluate(state, 0);
  return state.cost;
}

}  // namespace

TEST_CASE("the cost of a state is what the formula of lafortune.h gives") {
  const TexelSamples samples = rough_texel(1, {8, 8});
  FitOptions options{.ridge = 0};
  ChannelProblem problem(samples, 1, options);
  ChannelState state;
  state.shapes = {{{0.8, -1, 0.3}, 2.7}, {{-0.5, -0.4, 1}, 19}};
  state.sizes = {0.2, 0.1, 0.4};
  for (std::size_t v = 0; v < samples.view_count; ++v)
    state.table.push_back(0.7 + 0.01 * static_cast<double>(v));
  problem.evaluate(state, 0);
  std::vector<double> p{state.sizes[0]};
  for (std::size_t j = 0; j < 2; ++j) {
    const double n = state.shapes[j].exponent;
    for (const double d : state.shapes[j].direction) p.push_back(d * std::pow(state.sizes[j + 1], 1 / n));
    p.push_back(n);
  }
  double error = 0;
  for (std::size_t v = 0; v < samples.view_count; ++v) {
    const V3d view(V3f(samples.view_xyz[0][v], samples.view_xyz[1][v], samples.view_xyz[2][v]));
    for (std::size_t l = 0; l < samples.lights.size(); ++l) {
      const V3d light(samples.lights[l]);
      const double f = state.table[v] * lafortune(p.data(), 2, &light.x, &view.x);
      const double difference = f - static_cast<double>(samples.radiance[1][l * samples.stride() + v]);
      error += samples.view_weights[v] * difference * difference;
    }
  }
  // Single precision over blocks of 16 lights.
  CHECK(state.error == doctest::Approx(error).epsilon(1e-5));
}

TEST_CASE("the gradient belongs to the cost") {
  const TexelSamples samples = rough_texel(2, {8, 8});
  FitOptions options{.ridge = 1e-3};
  ChannelProblem problem(samples, 0, options);
  StartSearch search;
  search.set_samples(samples);
  ChannelState state = search.starts(0, 2, 1).front();
  for (LobeShape& shape : state.shapes) {
    shape.direction[(longest_component(shape) + 1) % 3] -= 0.1;
    shape.exponent *= 1.3;
  }
  // The table at its best for these sizes: its change does not change the cost.
  for (int i = 0; i < 100; ++i) problem.evaluate(state, 1);
  REQUIRE(std::min(state.sizes[1], state.sizes[2]) > 0);
  const auto [matrix, gradient] = problem.normal_equations(state);
  constexpr double step = 1e-3;
  for (std::size_t u = 0; u < 9; ++u) {
    const double slope =
        (cost_at(problem, state, u, step) - cost_at(problem, state, u, -step)) / (2 * step) / 2;
    const double size = std::sqrt(matrix[u * 9 + u] * state.cost);
    CHECK(std::abs(gradient[u] - slope) < 2e-3 * size);
  }
}

TEST_CASE("the search from the dictionary's starts is as good as the best of 20 random ones") {
  for (int seed = 1; seed <= 3; ++seed) {
    const TexelSamples samples = rough_texel(seed, {6, 6});
    FitOptions options;
    const auto fits = fit_texel(samples, options);
    for (int c = 0; c < 3; ++c) {
      ChannelProblem problem(samples, c, options);
      Random random(static_cast<std::uint64_t>(seed));
      double best = problem.weighted_squared_radiance();
      for (int restart = 0; restart < 20; ++restart) {
        ChannelState state;
        for (int lobe = 0; lobe < 2; ++lobe) {
          LobeShape shape;
          double largest = 1e-9;
          for (double& d : shape.direction)
            largest = std::max(largest, std::abs(d = 2 * random.uniform() - 1));
          for (double& d : shape.direction) d /= largest;
          shape.exponent = std::exp(4 * random.uniform());
          state.shapes.push_back(shape);
        }
        state.sizes = {0.1, 0.1, 0.1};
        state.table.assign(samples.view_count, 1);
        minimise(problem, state, options.tolerance, options.max_iterations);
        best = std::min(best, state.cost);
      }
      const auto at = static_cast<std::size_t>(c);
      const double scale = samples.scale[at] * samples.scale[at];
      CHECK(fits[at].cost <= 1.01 * best * scale);
    }
  }
}
