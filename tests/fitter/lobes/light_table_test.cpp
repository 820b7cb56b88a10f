// The table over lights S(l), fitted by turns with lobes and view table.
#include <doctest/doctest.h>

#include <cmath>
#include <numeric>

#include "fitter/fit.h"
#include "fitter/lobes/light_sums.h"
#include "fitter/lobes/lobe_fit.h"
#include "format/base/random.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/lafortune.h"
#include "tests/require.h"

using namespace selvedge;

namespace {

const DirectionGrid grid{8, 8};

/// Two texels, each rho and a lobe times T(v) and S(l), seen from everywhere.
struct Made {
  SamplesHeader header;
  SampleLevel level;
  std::vector<V3f> table;
  std::vector<V3f> light_table;
};

Made made_with(bool dark_half) {
  Made made;
  made.header.width = 2;
  made.header.height = 1;
  made.level.width = 2;
  made.level.height = 1;
  made.level.views = made.level.lights = grid.count();
  const auto directions = directions_of(grid);
  for (const V3f& d : directions) {
    const float light = dark_half && d.x < 0 ? 0.0F : 1 + 0.5F * d.x * d.y;
    made.table.emplace_back(1 + 0.3F * d.x, 1 - 0.2F * d.y, 1);
    made.light_table.emplace_back(light, light * (1 + 0.4F * d.y), light);
  }
  const std::array<float, 5> parameters{0.1F, -0.6F, -0.7F, 0.9F, 4};
  for (int t = 0; t < 2; ++t) {
    made.level.normal.emplace_back(0, 0, 1);
    for (std::size_t v = 0; v < directions.size(); ++v) {
      made.level.alpha.push_back(1);
      for (std::size_t l = 0; l < directions.size(); ++l) {
        const float g = lafortune(parameters.data(), 1, &directions[l].x, &directions[v].x);
        made.level.radiance.push_back(g * made.table[v] * made.light_table[l]);
      }
    }
  }
  return made;
}

FitResult fitted(const Made& made, bool light_table) {
  FitOptions options;
  options.lobes = 1;
  options.light_table = light_table;
  // Without the pull towards 1 that real samples need, the data's own tables come back.
  options.table = {1e-5, 1e-5};
  const auto result = test::need(fit(made.level, made.header, options));
  const auto valid = validate(result.fabric);
  CHECK_MESSAGE(valid, (valid ? "" : to_line(valid.error())));
  return result;
}

}  // namespace

TEST_CASE("a factor on the light goes into its table, whose mean is 1, and is evaluated") {
  const Made made = made_with(false);
  const FitResult without = fitted(made, false);
  const FitResult with = fitted(made, true);
  CHECK_FALSE(without.fabric.levels[0].has(LayerKind::light));
  CHECK(without.levels[0].training_error > 0.1);
  for (const LevelReport& level : with.levels) CHECK(level.training_error < 0.005);
  for (const FabricLevel& level : with.fabric.levels) {
    const std::span<const V3f> s = level.light_table();
    const V3f sum = std::accumulate(s.begin(), s.end(), V3f(0));
    for (int c = 0; c < 3; ++c)
      CHECK(sum[c] / static_cast<float>(s.size()) == doctest::Approx(1).epsilon(1e-5));
  }
  const auto directions = directions_of(grid);
  double error = 0;
  double energy = 0;
  for (std::size_t v = 0; v < directions.size(); ++v) {
    for (std::size_t l = 0; l < directions.size(); ++l) {
      const V3f truth = made.level.radiance[v * directions.size() + l];
      const Shading seen = evaluate(with.fabric, 0, 0, 0, directions[l], directions[v]);
      error += static_cast<double>((seen.radiance - truth).length2());
      energy += static_cast<double>(truth.length2());
    }
  }
  CHECK(std::sqrt(error / energy) < 0.005);
}

TEST_CASE("lights from which a texel is in the shadow give S near 0, and nothing negative") {
  const Made made = made_with(true);
  const FitResult with = fitted(made, true);
  CHECK(with.levels[0].training_error < 0.005);
  CHECK(fitted(made, false).levels[0].training_error > 0.3);
  const auto directions = directions_of(grid);
  const std::span<const V3f> s = with.fabric.levels[0].light_table();
  for (std::size_t l = 0; l < directions.size(); ++l) {
    CHECK(s[l].x >= 0);
    if (directions[l].x < -0.4F && directions[l].z > 0.4F) CHECK(s[l].x < 0.01F);
  }
}

TEST_CASE("the light table of a state is the least squares of its samples, light by light") {
  const Made made = made_with(false);
  const TexelDirections directions{directions_of(grid), directions_of(grid), {0, 0}, {0, 0}};
  const TexelSamples samples = gather_texel(made.level.alpha.data(), made.level.radiance.data(), directions,
                                            V3f(0, 0.6F, 0.8F), V3f(1, 0, 0));
  CHECK(samples.lights.size() < samples.light_count);
  ChannelOptions options;
  options.table = {0, 0};
  options.light_table = true;
  ChannelState state;
  state.shapes = {{{-0.5, -1, 0.8}, 3.5}};
  state.sizes = {0.2, 0.4};
  for (const V3f& d : directions.views) state.table.push_back(1.0 + 0.5 * static_cast<double>(d.x));
  ChannelProblem problem(samples, 1, options);
  problem.fit_light_table(state);
  for (std::size_t l = 0; l < samples.lights.size(); ++l) {
    double square = 0;
    double cross = 0;
    for (std::size_t v = 0; v < samples.views; ++v) {
      double base = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        base += state.shapes[0].direction[k] *
                static_cast<double>(samples.lights[l][static_cast<int>(k)] * samples.view[k][v]);
      }
      const double lobe = base > 0 ? 0.4 * std::pow(base, 3.5) : 0;
      const double g = state.table[v] * static_cast<double>(samples.lights[l].z) * (0.2 + lobe);
      square += g * g;
      cross += g * static_cast<double>(samples.radiance[1][l * samples.stride() + v]);
    }
    CHECK(state.light_table[samples.light_index[l]] == doctest::Approx(cross / square).epsilon(1e-5));
  }
}

TEST_CASE("random factors on every sample: a light table fits them no worse") {
  const Made made = made_with(true);
  Made noisy = made;
  Random random(7);
  for (V3f& r : noisy.level.radiance) r *= static_cast<float>(random.uniform());
  const FitResult with = fitted(noisy, true);
  const FitResult without = fitted(noisy, false);
  CHECK(with.levels[0].training_error <= without.levels[0].training_error);
  for (const float p : with.fabric.levels[0].lobes()) CHECK(std::isfinite(p));
}
