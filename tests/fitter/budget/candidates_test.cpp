#include "fitter/budget/candidates.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "fitter/budget/level_error.h"
#include "fitter/slabs/coded_size.h"
#include "fitter/slabs/quantise.h"
#include "fitter/slabs/slab_tables.h"
#include "fitter/solve/principal.h"
#include "format/base/random.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"
#include "tests/fitter/slab_fabrics.h"
#include "tests/format/fabrics.h"
#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;

using namespace selvedge::test;

namespace {

double squared_error(const LevelReport& level) { return *level.validation * *level.validation; }

}  // namespace

TEST_CASE("principal components of a known matrix") {
  // Eigenvalues 3 and 1 along (1, 1) and (1, -1).
  const Principal p = principal_components({2, 1, 1, 2}, 2, 2);
  REQUIRE(p.values.size() == 2);
  CHECK(p.values[0] == doctest::Approx(3));
  CHECK(p.values[1] == doctest::Approx(1));
  CHECK(p.vectors[0][0] == doctest::Approx(std::sqrt(0.5)));
  CHECK(p.vectors[0][1] == doctest::Approx(std::sqrt(0.5)));
}

TEST_CASE(
    "the smooth functions of the view are orthonormal over their grid, and as many as it can tell apart") {
  const auto functions = smooth_view_functions({8, 8}, 6);
  REQUIRE(functions.size() == 6);
  CHECK(std::all_of(functions[0].begin(), functions[0].end(), [](float f) { return f == 1; }));
  for (std::size_t a = 0; a < 6; ++a) {
    for (std::size_t b = 0; b < 6; ++b) {
      double mean = 0;
      for (std::size_t v = 0; v < 64; ++v)
        mean += static_cast<double>(functions[a][v] * functions[b][v]) / 64;
      CHECK(mean == doctest::Approx(a == b ? 1 : 0).epsilon(0.01).scale(1));
    }
  }
  CHECK(smooth_view_functions({1, 1}, 6).size() == 1);
  CHECK(smooth_view_functions({1, 2}, 6).size() == 2);
}

TEST_CASE("slabs are found again from what texels show") {
  const Fabric fabric = ribbed(12, 3);
  const SampleLevel samples = seen_of(fabric);
  const auto views = smooth_view_functions(fabric.views, 4);
  const SlabRays rays = slab_rays(fabric.levels[0], fabric, directions_of(fabric.views));
  const std::size_t entries = fabric.levels[0].heights().size();
  const SlabTables tables = fit_slabs(samples, rays, entries, views);
  const BasisFit products = slab_basis({tables}, views, 9).front();
  REQUIRE(products.owners() == entries);
  // Every sample, from the tables alone: the rays of a texel share alpha f between them.
  double error = 0;
  double energy = 0;
  const auto lights = static_cast<std::size_t>(samples.lights);
  for (std::size_t row = 0; row < samples.alpha.size(); ++row) {
    const std::size_t view = row % static_cast<std::size_t>(samples.views);
    for (std::size_t l = 0; l < lights; ++l) {
      const double seen = static_cast<double>(samples.alpha[row] * samples.radiance[row * lights + l].x);
      double fitted = 0;
      for (std::size_t ray = 0; ray < 2; ++ray) {
        const std::uint32_t met = rays.entries[2 * row + ray];
        if (met == SlabRays::no_entry) continue;
        for (std::size_t m = 0; m < products.pairs.size(); ++m) {
          const V2i pair = products.pairs[m];
          fitted += 0.5 * static_cast<double>(products.coefficient[met * products.pairs.size() + m] *
                                              products.view[pair.x][view] * products.light[pair.y][3 * l]);
        }
      }
      error += (fitted - seen) * (fitted - seen);
      energy += seen * seen;
    }
  }
  CHECK(std::sqrt(error / energy) < 0.03);  // the pull towards the mean, and the functions' rounding
}

TEST_CASE("texels that are products of few functions are found again") {
  const DirectionGrid views{4, 4};
  const DirectionGrid lights{4, 3};
  Random random(2);
  std::vector<SampleLevel> levels;
  for (const int width : {4, 2}) {
    SampleLevel level;
    level.width = level.height = width;
    level.views = views.count();
    level.lights = lights.count();
    level.normal.assign(width * width, V3f(0, 0, 1));
    for (int texel = 0; texel < width * width; ++texel) {
      const auto a = static_cast<float>(random.uniform());
      const auto b = static_cast<float>(random.uniform());
      for (const V3f& v : directions_of(views)) {
        level.alpha.push_back(level.alpha.size() % 16 == 5 ? 0.0F : a);  // one view sees holes
        for (const V3f& l : directions_of(lights)) {
          level.radiance.emplace_back(a * l.z * (1 + v.x) + b * v.z * (l.y + 1), a * l.z * (1 + v.x),
                                      b * v.z);
        }
      }
    }
    levels.push_back(level);
  }
  const std::vector<BasisFit> fitted = texel_basis(levels, 6, 8);
  for (std::size_t k = 0; k < levels.size(); ++k) {
    const SampleLevel& level = levels[k];
    double error = 0;
    double energy = 0;
    for (std::size_t row = 0; row < level.alpha.size(); ++row) {
      const std::size_t texel = row / 16;
      for (std::size_t l = 0; l < 12; ++l) {
        for (int c = 0; c < 3; ++c) {
          double f = 0;
          for (std::size_t m = 0; m < fitted[k].pairs.size(); ++m) {
            const V2i pair = fitted[k].pairs[m];
            f += static_cast<double>(fitted[k].coefficient[texel * fitted[k].pairs.size() + m] *
                                     fitted[k].view[pair.x][row % 16] *
                                     fitted[k].light[pair.y][3 * l + static_cast<std::size_t>(c)]);
          }
          const auto alpha = static_cast<double>(level.alpha[row]);
          const auto truth = static_cast<double>(level.radiance[row * 12 + l][c]);
          error += alpha * alpha * (f - truth) * (f - truth);
          energy += alpha * alpha * truth * truth;
        }
      }
    }
    CHECK(std::sqrt(error / energy) < 0.01);  // the functions' rounding, and a slight pull towards 0
  }
}

TEST_CASE("coarse heights are means over the area that has them") {
  const HeightLayer fine{{1, 1, 1}, {1, 3, 0, 2, 1, 0, 0, 0}, {0.5F, 1, 0, 1, 0.5F, 0, 0, 0}};
  const HeightLayer coarse = pool_heights(fine, 4, 2);
  REQUIRE(coarse.top.size() == 2);
  CHECK(coarse.top[0] == doctest::Approx(5.0 / 3));
  CHECK(coarse.bottom[0] == doctest::Approx(2.0 / 3));
  CHECK(coarse.top[1] == 0);  // a quarter of the area
}

TEST_CASE("heights of a coarser shape are means of the finer cells, of the uppermost slabs") {
  // One texel of 2 x 1 cells with two slabs.
  const HeightLayer fine{{2, 1, 2}, {4, 2, 1, 1}, {3, 1, 0, 0}};
  const HeightLayer coarse = regrid_heights(fine, 1, 1, {1, 1}, {1, 1, 1});
  CHECK(coarse.top == std::vector<float>{3});
  CHECK(coarse.bottom == std::vector<float>{2});
}

TEST_CASE("what texels show of two entries at once is the sum of the products of their shares") {
  // Two rays; three directions: both meet entry 0; 0 and 1; 1 and nothing.
  const SlabRays rays{2, {0, 0, 0, 1, 1, SlabRays::no_entry}};
  const SlabOverlaps overlaps = overlaps_of(rays, 3);
  REQUIRE(overlaps.own.size() == 3);
  CHECK(overlaps.own[0] == doctest::Approx(1 + 0.25));
  CHECK(overlaps.own[1] == doctest::Approx(0.25 + 0.25));
  CHECK(overlaps.own[2] == 0);
  CHECK(overlaps.first == std::vector<std::size_t>{0, 1, 2, 2});
  CHECK(overlaps.other == std::vector<std::uint32_t>{1, 0});
  CHECK(overlaps.shared[0] == doctest::Approx(0.25));
}

TEST_CASE("coefficients at no price are rounded to multiples of the step, and weak products go") {
  BasisFit products;
  products.view = {{1}};
  products.light = {{1}, {1}};
  products.pairs = {{0, 0}, {0, 1}};
  products.coefficient = {1.1F, 0.01F, -0.9F, 0.02F};
  Quantisation how;
  how.step = 0.25F;
  how.min_rms = 0.5F;
  how.width = 2;
  const BasisFit coarse = quantise(products, how, nullptr);
  CHECK(kept_pair_count(products, how) == 1);
  CHECK(coarse.pairs == std::vector<V2i>{{0, 0}});
  CHECK(coarse.coefficient == std::vector<float>{1, -1});
  how.step = 0.0078125F;
  CHECK(quantise(products, how, nullptr).pairs.size() == 2);
}

TEST_CASE("the higher the price of a bit, the fewer bytes the coefficients take") {
  BasisFit products;
  products.view = {{1}};
  products.light = {{1}, {1}, {1}};
  products.pairs = {{0, 0}, {0, 1}, {0, 2}};
  Random random(7);
  for (int i = 0; i < 3 * 32 * 32; ++i) {
    products.coefficient.push_back(static_cast<float>(std::pow(2 * random.uniform() - 1, 3)));
  }
  Quantisation how;
  how.step = 0.125F;
  how.width = 32;
  double last = 1e9;
  double last_error = 0;
  for (const float price : {0.0F, 0.2F, 1.0F, 5.0F}) {
    how.price = price;
    const std::vector<float> coded = quantise(products, how, nullptr).coefficient;
    double error = 0;
    for (std::size_t i = 0; i < coded.size(); ++i) {
      error += std::pow(static_cast<double>(coded[i] - products.coefficient[i]), 2);
    }
    const double bytes = coded_bytes(coded, 3, 32);
    CHECK(bytes < last);
    CHECK(error > last_error);
    last = bytes;
    last_error = error;
  }
}

TEST_CASE("entries that are seen together make good each other's rounding, and unseen ones stay finite") {
  // Four entries in one texel, of which every view shows three at once; each is 0.4 of a step.
  SlabRays rays{3, {}};
  for (const std::uint32_t hidden : {0U, 1U, 2U, 3U}) {
    for (const std::uint32_t entry : {0U, 1U, 2U, 3U}) {
      if (entry != hidden) rays.entries.push_back(entry);
    }
  }
  BasisFit products;
  products.view = {{1}};
  products.light = {{1}};
  products.pairs = {{0, 0}};
  products.coefficient = {0.4F, 0.4F, 0.4F, 0.4F, 1e30F};
  Quantisation how;
  how.entries = 5;
  const SlabOverlaps overlaps = overlaps_of(rays, 5);
  const std::vector<float> coded = quantise(products, how, &overlaps).coefficient;
  double sum = 0;
  for (std::size_t e = 0; e < 4; ++e) sum += static_cast<double>(coded[e]);
  CHECK(sum == doctest::Approx(2));  // rounding alone would make it 0; the truth is 1.6
  CHECK(std::isfinite(coded[4]));
}

TEST_CASE("the size of a layer is known before it is written") {
  const test::Folder folder;
  Fabric fabric = test::random_fabric(32, 32, {8, 8}, 1, 3);
  fabric.levels.resize(1);
  const std::vector<float> opacity = fabric.levels[0][LayerKind::opacity].values;
  REQUIRE(write_fabric(folder / "with.exr", fabric));
  fabric.levels[0].remove(LayerKind::opacity);
  REQUIRE(write_fabric(folder / "without.exr", fabric));
  // The part has 64 channels in the header, and the previews differ.
  const auto difference = static_cast<double>(std::filesystem::file_size(folder / "with.exr")) -
                          static_cast<double>(std::filesystem::file_size(folder / "without.exr"));
  CHECK(coded_bytes(opacity, 64, 32) == doctest::Approx(difference - 64 * 30).epsilon(0.05));
}

TEST_CASE("layers are chosen within the budget, and more bytes never make the choice worse") {
  const Fabric fabric = ribbed(16, 16);
  SamplesHeader header = samples_header_of(fabric);
  const PairSamples truth = truth_of(fabric, 12);
  header.pairs[0] = truth.pairs;
  FitOptions options;
  options.lobes = 1;
  const auto fitter =
      test::need(LayerFitter::create(seen_of(fabric), header, heights_of(fabric), truth, options));
  double last = 1e9;
  for (const double bytes : {16000.0, 20000.0, 40000.0, 1e6}) {
    const LayerFit chosen = fitter.choose(bytes);
    REQUIRE(validate(chosen.fabric));
    REQUIRE(chosen.levels.size() == 5);
    CHECK(chosen.bytes <= bytes);
    // Level 0 counts most; the sum over levels is what is made least.
    double sum = 0;
    for (std::size_t k = 0; k < 5; ++k) sum += (k == 0 ? 5 : 1) * std::log(squared_error(chosen.levels[k]));
    for (std::size_t k = 0; k < 5; ++k) {
      CHECK(chosen.levels[k].iterations.has_value() == chosen.fabric.levels[k].has(LayerKind::lobes));
    }
    CHECK(sum <= last);
    last = sum;
    // What is said of a level is so.
    const std::vector<LevelTruth> truths = level_truths(truth);
    const double error = level_error(chosen.fabric.levels[0], chosen.fabric, truth.pairs, truths[0]);
    CHECK(error == doctest::Approx(squared_error(chosen.levels[0])).epsilon(0.02));
  }
}

TEST_CASE("the choice of layers scales with the radiance") {
  const Fabric fabric = ribbed(16, 16);
  SamplesHeader header = samples_header_of(fabric);
  FitOptions options;
  options.lobes = 1;
  std::vector<std::string> layers;
  for (const float factor : {1.0F, 0x1p-90F, 0x1p-30F, 0x1p30F, 0x1p90F}) {
    CAPTURE(factor);
    PairSamples truth = truth_of(fabric, 12);
    header.pairs[0] = truth.pairs;
    SampleLevel seen = seen_of(fabric);
    for (std::vector<V3f>* radiance : {&truth.radiance, &seen.radiance}) {
      for (V3f& r : *radiance) r *= factor;
    }
    const auto fitter = test::need(LayerFitter::create(seen, header, heights_of(fabric), truth, options));
    const LayerFit chosen = fitter.choose(40000);
    REQUIRE(validate(chosen.fabric));
    std::string text;
    for (const LevelReport& level : chosen.levels) text += level.layers + "; ";
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

TEST_CASE("without pairs to choose by, or with heights of other texels, layers are refused") {
  const Fabric fabric = ribbed(4, 4);
  SamplesHeader header = samples_header_of(fabric);
  const PairSamples truth = truth_of(fabric, 2);
  CHECK(test::error_of(LayerFitter::create(seen_of(fabric), header, {}, PairSamples{}, {})).code ==
        Code::samples_malformed);
  const HeightLayer other{{1, 1, 1}, {1}, {0}};
  CHECK(test::error_of(LayerFitter::create(seen_of(fabric), header, other, truth, {})).code ==
        Code::samples_malformed);
}
