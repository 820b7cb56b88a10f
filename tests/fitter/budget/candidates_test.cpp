#include "fitter/budget/candidates.h"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "format/base/random.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"
#include "format/samples/samples.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::test;

namespace {

/// Samples of an ideal bake of a fabric: alpha and f of every texel for the directions of the grids.
SampleLevel seen_of(const Fabric& fabric) {
  const FabricLevel& level = fabric.levels.front();
  SampleLevel samples{.width = level.width,
                      .height = level.height,
                      .views = fabric.views.count(),
                      .lights = fabric.lights.count()};
  samples.normal_sum.assign(level.texels(), V3f(0, 0, 1));
  for (std::size_t i = 0; i < level.frame().size(); ++i) samples.normal_sum[i] = level.frame()[i].normal;
  for (int texel = 0; texel < level.texels(); ++texel) {
    for (const V3f& view : cell_directions(fabric.views)) {
      const auto shade = [&](const V3f& light) {
        return evaluate(fabric, 0, texel % level.width, texel / level.width, light, view);
      };
      samples.alpha.push_back(shade({0, 0, 1}).alpha);
      for (const V3f& light : cell_directions(fabric.lights))
        samples.radiance.push_back(shade(light).radiance);
    }
  }
  return samples;
}

/// Texels with one product that differs from texel to texel, and a second that turns with the view; every
/// fifth is mostly hole.
Fabric patterned(int width, int height) {
  Fabric fabric;
  fabric.period_mm = {static_cast<float>(width), static_cast<float>(height)};
  fabric.reference_height = 1;
  fabric.thickness_mm = 1;
  fabric.views = {4, 4};
  fabric.lights = {3, 3};
  Random random(5);
  FabricLevel level;
  level.width = width;
  level.height = height;
  level.pairs = {{0, 0}, {1, 1}};
  level.add_layer(LayerKind::products, 2);
  level.add_layer(LayerKind::opacity, fabric.views.count(), 1);
  for (int i = 0; i < width * height; ++i) {
    level.coefficients()[2 * i] = 1 + static_cast<float>(random.uniform());
    level.coefficients()[2 * i + 1] = 0.5F * static_cast<float>(random.uniform());
    const auto alpha = level.opacity().subspan(std::size_t{16} * i, 16);
    if (i % 5 == 0) std::fill(alpha.begin(), alpha.end(), 0.25F);
  }
  ProductBases bases;
  for (const V3f& view : cell_directions(fabric.views)) bases.view.push_back(view.x);
  for (const V3f& light : cell_directions(fabric.lights))
    bases.light.emplace_back(light.z, light.z, light.z / 2);
  for (const V3f& light : cell_directions(fabric.lights))
    bases.light.emplace_back(V3f(0.25F + light.y * light.y));
  level.bases = std::make_shared<const ProductBases>(bases);
  fabric.levels = {level};
  return fabric;
}

/// The samples file of a fabric: its header, and pairs with the fabric itself as the truth.
SamplesHeader samples_header_of(const Fabric& fabric) {
  SamplesHeader header;
  header.width = fabric.levels[0].width;
  header.height = fabric.levels[0].height;
  header.period_mm = fabric.period_mm;
  header.reference_height = fabric.reference_height;
  header.thickness_mm = fabric.thickness_mm;
  header.views = fabric.views;
  header.lights = fabric.lights;
  return header;
}

PairSamples truth_of(const Fabric& fabric, int count) {
  PairSamples truth{.width = fabric.levels[0].width,
                    .height = fabric.levels[0].height,
                    .pairs = random_direction_pairs(count, 0.3, 3)};
  for (const DirectionPair& pair : truth.pairs) {
    for (int i = 0; i < truth.width * truth.height; ++i) {
      const Shading s = evaluate(fabric, 0, i % truth.width, i / truth.width, pair.light, pair.view);
      truth.alpha.push_back(s.alpha);
      truth.radiance.push_back(s.radiance);
    }
  }
  return truth;
}

/// A fabric, samples of it, and how they are fitted.
struct Patterned {
  explicit Patterned(int pairs) : truth(truth_of(fabric, pairs)) {
    header.pairs[0] = truth.pairs;
    options.lobes = 1;
  }
  Fabric fabric = patterned(16, 16);
  SamplesHeader header = samples_header_of(fabric);
  PairSamples truth;
  FitOptions options;
};

double squared_error(const LayerFit& fit, std::size_t level) { return fit.errors[level] * fit.errors[level]; }

}  // namespace

TEST_CASE("layers are chosen within the budget, and more bytes never make the choice worse") {
  const Patterned cloth(12);
  const auto fitter =
      test::need(LayerFitter::create(seen_of(cloth.fabric), cloth.header, cloth.truth, cloth.options));
  double last = 1e9;
  for (const double bytes : {4000.0, 8000.0, 28000.0, 1e6}) {
    const LayerFit chosen = fitter.choose_within(bytes);
    REQUIRE(fabric_file_bytes(chosen.fabric));
    REQUIRE(chosen.fabric.levels.size() == 5);
    CHECK(chosen.bytes <= bytes);
    // Level 0 counts most; the sum over levels is what is made least.
    double sum = 0;
    for (std::size_t k = 0; k < 5; ++k) sum += (k == 0 ? 5 : 1) * std::log(squared_error(chosen, k));
    CHECK(sum <= last);
    last = sum;
    const std::vector<LevelTruth> truths = level_truths(cloth.truth);
    const double error = level_error(chosen.fabric.levels[0], chosen.fabric, cloth.truth.pairs, truths[0]);
    CHECK(error == doctest::Approx(squared_error(chosen, 0)).epsilon(0.02));
  }
}

TEST_CASE("products are as bright as the validation pairs and measured ones, within limits") {
  const Patterned cloth(32);
  const PairSamples few = truth_of(cloth.fabric, 8);
  // The sum over all pairs and texels of the finest level of products.
  const auto shown = [&](const V3f& brighter, bool measured = false) {
    PairSamples scaled = cloth.truth;
    for (V3f& radiance : scaled.radiance) radiance *= brighter;
    const auto fitter =
        test::need(LayerFitter::create(seen_of(cloth.fabric), cloth.header, measured ? few : scaled,
                                       cloth.options, {}, measured ? scaled : PairSamples{}));
    const LayerFit fit = fitter.choose_within(4000);
    const FabricLevel& level = fit.fabric.levels.front();
    REQUIRE(level.has(LayerKind::products));
    V3d sum(0, 0, 0);
    for (const DirectionPair& pair : cloth.truth.pairs) {
      for (int t = 0; t < level.texels(); ++t) {
        const Shading s =
            evaluate(level, fit.fabric, t % level.width, t / level.width, pair.light, pair.view);
        sum += V3d(s.radiance * s.alpha);
      }
    }
    return sum;
  };
  const V3d same = shown({1, 1, 1});
  const V3d tinted = shown({1.2F, 1, 3});
  CHECK(tinted.x / same.x == doctest::Approx(1.2).epsilon(0.02));
  CHECK(tinted.y / same.y == doctest::Approx(1).epsilon(0.02));
  CHECK(tinted.z / same.z < 1.3);
  // 8 validation pairs alone say nothing; with 32 measured ones, four fifths of the pairs are brighter.
  const V3d of_measured = shown({1.2F, 1, 1}, true);
  CHECK(of_measured.x / same.x == doctest::Approx(1 + 0.2 * 4 / 5).epsilon(0.02));
  CHECK(of_measured.y / same.y == doctest::Approx(1).epsilon(0.02));
}

TEST_CASE("the choice of layers scales with the radiance") {
  const Fabric fabric = patterned(16, 16);
  SamplesHeader header = samples_header_of(fabric);
  FitOptions options{.lobes = 1};
  std::vector<std::string> layers;
  for (const float factor : {1.0F, 0x1p-90F, 0x1p-30F, 0x1p30F, 0x1p90F}) {
    CAPTURE(factor);
    PairSamples truth = truth_of(fabric, 12);
    header.pairs[0] = truth.pairs;
    SampleLevel seen = seen_of(fabric);
    for (std::vector<V3f>* radiance : {&truth.radiance, &seen.radiance})
      for (V3f& r : *radiance) r *= factor;
    const auto fitter = test::need(LayerFitter::create(seen, header, truth, options));
    const LayerFit chosen = fitter.choose_within(28000);
    REQUIRE(fabric_file_bytes(chosen.fabric));
    std::string text;
    for (const FabricLevel& level : chosen.fabric.levels)
      text += fmt::format("{} lobes, {} products; ", level.has(LayerKind::lobes) ? level.lobe_count() : 0,
                          level.pairs.size());
    layers.push_back(text);
    const std::vector<LevelTruth> truths = level_truths(truth);
    double error = 0;
    double energy = 0;
    for (std::size_t pair = 0; pair < truth.pairs.size(); ++pair) {
      for (std::size_t t = 0; t < 256; ++t) {
        const Shading s = evaluate(chosen.fabric, 0, static_cast<int>(t % 16), static_cast<int>(t / 16),
                                   truth.pairs[pair].light, truth.pairs[pair].view);
        const V3d shown = V3d(s.radiance) * static_cast<double>(s.alpha);
        error +=
            (shown / static_cast<double>(factor) - truths[0].pairs[pair][t] / static_cast<double>(factor))
                .length2();
        energy += (truths[0].pairs[pair][t] / static_cast<double>(factor)).length2();
      }
    }
    CHECK(std::sqrt(error / energy) < 0.2);
  }
  for (const std::string& text : layers) CHECK(text == layers[0]);
}
