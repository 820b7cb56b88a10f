#include "fitter/gloss/slab_lobes.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "fitter/budget/candidates.h"
#include "format/base/parallel.h"
#include "format/fabric/file.h"
#include "format/quality/compare.h"
#include "tests/fitter/slab_fabrics.h"
#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::test;

namespace {

SlabLobeFit lobes_of(const Fabric& fabric, const SampleLevel& samples, const SlabLobeOptions& options = {}) {
  const SlabRays rays = slab_rays(fabric.levels[0], fabric, directions_of(fabric.views));
  return fit_slab_lobes(samples, rays, fabric.levels[0].heights().size(), fabric.views, fabric.lights,
                        options);
}

bool is_finite(const SlabLobeFit& fit) {
  const auto finite = [](double x) { return std::isfinite(x); };
  FabricLevel level;
  set_gloss(fit.gloss, level);
  bool good = std::all_of(fit.errors.begin(), fit.errors.end(), finite) &&
              std::all_of(level.lobes().begin(), level.lobes().end(), finite) &&
              std::all_of(fit.gloss.unit.begin(), fit.gloss.unit.end(), [](float u) { return u > 0; });
  for (std::size_t t = 0; t < level.frame().size(); ++t) {
    good = good && std::abs(level.frame()[t].normal.length() - 1) < 1e-5F &&
           std::abs(level.frame()[t].tangent.length() - 1) < 1e-5F &&
           std::abs(level.frame()[t].normal.dot(level.frame()[t].tangent)) < 1e-5F;
  }
  return good;
}

/// A fabric of that size with samples that are to be set.
SampleLevel black(const Fabric& fabric) {
  SampleLevel samples = seen_of(fabric);
  std::fill(samples.radiance.begin(), samples.radiance.end(), V3f(0, 0, 0));
  return samples;
}

}  // namespace

TEST_CASE("lobes of slabs are found again from what texels show") {
  const Fabric fabric = glossy(12, 4);
  const SampleLevel samples = seen_of(fabric);
  SlabLobeOptions options;
  options.max_turns = 12;
  options.max_steps = 20;
  const SlabLobeFit fit = lobes_of(fabric, samples, options);
  CHECK(fit.errors.front() > 0.2);  // with the cosine alone
  CHECK(fit.errors.back() < 0.03);  // the pull of the tables towards their mean
  // g of every texel is the fabric's, but for a factor of the texel and one of the light, which its tables
  // hold: the view's share of it is compared, light by light.
  const GlossDirections directions = gloss_directions(fabric.views, fabric.lights);
  FabricLevel found = fabric.levels[0];
  set_gloss(fit.gloss, found);
  found.remove(LayerKind::heights);
  found.remove(LayerKind::products);
  FabricLevel truth = fabric.levels[0];
  truth.remove(LayerKind::heights);
  truth.remove(LayerKind::products);
  double error = 0;
  double energy = 0;
  for (int x = 0; x < 12; ++x) {
    for (const V3d& light : directions.lights) {
      double ff = 0;
      double ft = 0;
      double tt = 0;
      for (const V3d& view : directions.views) {
        const auto f = static_cast<double>(evaluate(found, fabric, x, 1, V3f(light), V3f(view)).radiance.x);
        const auto t = static_cast<double>(evaluate(truth, fabric, x, 1, V3f(light), V3f(view)).radiance.x);
        ff += f * f;
        ft += f * t;
        tt += t * t;
      }
      error += ff > 0 ? tt - ft * ft / ff : tt;
      energy += tt;
    }
  }
  CHECK(std::sqrt(error / energy) < 0.05);
}

TEST_CASE("every turn of lobes and tables lowers the error, and it is that of the samples") {
  const Fabric fabric = glossy(8, 4);
  const SampleLevel samples = seen_of(fabric);
  SlabLobeOptions options;
  options.lobes = 2;
  options.max_steps = 3;
  const SlabLobeFit fit = lobes_of(fabric, samples, options);
  REQUIRE(fit.errors.size() > 2);
  for (std::size_t i = 1; i < fit.errors.size(); ++i) CHECK(fit.errors[i] < fit.errors[i - 1]);
  // The last, from the tables and the reference evaluation.
  const SlabRays rays = slab_rays(fabric.levels[0], fabric, directions_of(fabric.views));
  const std::size_t entries = fabric.levels[0].heights().size();
  const std::vector<std::vector<float>> constant{std::vector<float>(36, 1)};
  const GlossDirections directions = gloss_directions(fabric.views, fabric.lights);
  const SlabFactors factors = factors_of(fit.gloss, directions);
  const SlabTables tables = fit_slabs(samples, rays, entries, constant, &factors);
  FabricLevel gloss = fabric.levels[0];
  set_gloss(fit.gloss, gloss);
  gloss.remove(LayerKind::heights);
  gloss.remove(LayerKind::products);
  double error = 0;
  double energy = 0;
  for (std::size_t row = 0; row < samples.alpha.size(); ++row) {
    for (std::size_t l = 0; l < 36; ++l) {
      const V3f seen = samples.alpha[row] * samples.radiance[row * 36 + l];
      V3d rest(seen);
      for (std::size_t ray = 0; ray < 2; ++ray) {
        const std::uint32_t met = rays.entries[2 * row + ray];
        if (met == SlabRays::no_entry) continue;
        const auto texel = static_cast<int>(met / 2);
        const V3f g = evaluate(gloss, fabric, texel % 8, texel / 8, V3f(directions.lights[l]),
                               V3f(directions.views[row % 36]))
                          .radiance;
        for (int c = 0; c < 3; ++c) {
          const std::size_t i = 3 * l + static_cast<std::size_t>(c);
          rest[c] -= 0.5 * static_cast<double>(g[c] * tables.value[met * 108 + i] / fit.gloss.unit[i]);
        }
      }
      error += rest.length2();
      energy += V3d(seen).length2();
    }
  }
  CHECK(std::sqrt(error / energy) == doctest::Approx(fit.errors.back()).epsilon(1e-3));
}

TEST_CASE("lobes of slabs are the same for any number of threads") {
  const Fabric fabric = glossy(8, 4);
  const SampleLevel samples = seen_of(fabric);
  SlabLobeOptions options;
  options.lobes = 2;
  options.max_turns = 3;
  std::vector<FabricLevel> levels;
  for (const int threads : {1, 4}) {
    set_threads(threads);
    set_gloss(lobes_of(fabric, samples, options).gloss, levels.emplace_back());
  }
  set_threads(0);
  CHECK(levels[0][LayerKind::lobes] == levels[1][LayerKind::lobes]);
  CHECK(levels[0][LayerKind::frame] == levels[1][LayerKind::frame]);
}

TEST_CASE("lobes of slabs are finite whatever the samples") {
  const Fabric fabric = glossy(6, 3);
  SUBCASE("black") {
    const SlabLobeFit fit = lobes_of(fabric, black(fabric));
    CHECK(is_finite(fit));
    CHECK(fit.errors == std::vector<double>{0});
    CHECK(fit.gloss.kinds.front().shapes.size() == 1);
  }
  SUBCASE("one bright sample among black ones") {
    SampleLevel samples = black(fabric);
    samples.radiance[1000] = V3f(1e6F);
    CHECK(is_finite(lobes_of(fabric, samples)));
  }
  SUBCASE("holes from every view") {
    SampleLevel samples = seen_of(fabric);
    std::fill(samples.alpha.begin(), samples.alpha.end(), 0.0F);
    CHECK(is_finite(lobes_of(fabric, samples)));
  }
  SUBCASE("normals that average to nothing, or lie in the cloth") {
    SampleLevel samples = seen_of(fabric);
    for (std::size_t t = 0; t < samples.normal.size(); ++t) {
      samples.normal[t] = t % 2 == 0 ? V3f(0, 0, 0) : V3f(1, 0, 0);
    }
    CHECK(is_finite(lobes_of(fabric, samples)));
  }
  SUBCASE("one view and one light") {
    Fabric one = glossy(6, 3);
    one.views = {1, 1};
    one.lights = {1, 1};
    ProductBases bases;
    bases.light = {V3f(1, 1, 1)};
    one.levels[0].bases = std::make_shared<const ProductBases>(bases);
    CHECK(is_finite(lobes_of(one, seen_of(one))));
  }
  SUBCASE("noise of six decades") {
    SampleLevel samples = seen_of(fabric);
    Random random(3);
    for (V3f& r : samples.radiance) r *= static_cast<float>(std::pow(10.0, 6 * random.uniform() - 3));
    SlabLobeOptions options;
    options.lobes = 3;
    CHECK(is_finite(lobes_of(fabric, samples, options)));
  }
}

TEST_CASE("where yarn is glossy slabs with lobes are chosen, and the file is as good as was said") {
  const Fabric fabric = glossy(16, 16);
  SamplesHeader header = samples_header_of(fabric);
  const PairSamples truth = truth_of(fabric, 16);
  header.pairs[0] = truth.pairs;
  FitOptions options;
  options.lobes = 1;
  const auto fitter =
      test::need(LayerFitter::create(seen_of(fabric), header, heights_of(fabric), truth, options));
  const LayerFit chosen = fitter.choose(30000);
  CHECK(chosen.levels[0].layers.find("2 lobes, 1 slab") == 0);
  CHECK_FALSE(chosen.levels[0].iterations);  // whose report is that of the paper's model
  const Folder folder;
  REQUIRE(write_fabric(folder / "f.exr", chosen.fabric));
  const auto read = test::need(read_fabric(folder / "f.exr"));
  const std::vector<LevelTruth> truths = level_truths(truth);
  const double error = level_error(read.levels[0], read, truth.pairs, truths[0]);
  CHECK(std::sqrt(error) == doctest::Approx(*chosen.levels[0].validation).epsilon(0.01));
  // Levels of the paper's model get lobes of no size: all levels have as many.
  for (const FabricLevel& level : read.levels) {
    if (level.has(LayerKind::lobes)) CHECK(level.lobe_count() == 2);
  }
  // On demand, at every level with cells enough.
  options.glossy_slabs = true;
  options.slab_lobes = 1;
  const auto forced =
      test::need(LayerFitter::create(seen_of(fabric), header, heights_of(fabric), truth, options));
  const LayerFit all = forced.choose(60000);
  CHECK(all.levels[0].layers.find("1 lobe, 1 slab") == 0);
  CHECK(all.levels[1].layers.find("slab") == std::string::npos);  // 8 rows of cells
  REQUIRE(validate(all.fabric));
  options.glossy_slabs = false;
  options.slab_lobes = 0;
  const auto without =
      test::need(LayerFitter::create(seen_of(fabric), header, heights_of(fabric), truth, options));
  const LayerFit plain = without.choose(30000);
  CHECK(plain.levels[0].layers.find("lobes, 1 slab") == std::string::npos);
  CHECK(*plain.levels[0].validation > std::sqrt(2.0) * *chosen.levels[0].validation);
}
