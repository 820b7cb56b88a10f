#include "fitter/budget/candidates.h"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"
#include "tests/fitter/texel_fabrics.h"
#include "tests/require.h"

using namespace selvedge;

using namespace selvedge::test;

namespace {

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
