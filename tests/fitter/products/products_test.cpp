#include "fitter/products/quantise.h"

#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>

#include "fitter/products/texel_basis.h"
#include "format/base/random.h"
#include "format/fabric/file.h"
#include "tests/format/fabrics.h"
#include "tests/format/files.h"

using namespace selvedge;

TEST_CASE("coefficients at no price are rounded to multiples of the step, and weak products go") {
  BasisFit products{.view_functions = {{1}},
                    .light_functions = {{1}, {1}},
                    .pairs = {{0, 0}, {0, 1}},
                    .coefficient = {1.1F, 0.01F, -0.9F, 0.02F}};
  Quantisation how{.step = 0.25F, .min_rms = 0.5F, .row_texels = 2};
  const BasisFit coarse = quantise(products, how);
  CHECK(kept_pair_count(products, how) == 1);
  CHECK(coarse.pairs == std::vector<V2i>{{0, 0}});
  CHECK(coarse.coefficient == std::vector<float>{1, -1});
  how.step = 0.0078125F;
  CHECK(quantise(products, how).pairs.size() == 2);
}

TEST_CASE("the higher the price of a bit, the fewer bytes the coefficients take") {
  BasisFit products;
  products.view_functions = {{1}};
  products.light_functions = {{1}, {1}, {1}};
  products.pairs = {{0, 0}, {0, 1}, {0, 2}};
  Random random(7);
  for (int i = 0; i < 3 * 32 * 32; ++i)
    products.coefficient.push_back(static_cast<float>(std::pow(2 * random.uniform() - 1, 3)));
  Quantisation how{.step = 0.125F, .row_texels = 32};
  double last = 1e9;
  double last_error = 0;
  for (const float price : {0.0F, 0.2F, 1.0F, 5.0F}) {
    how.bit_cost = price;
    const std::vector<float> coded = quantise(products, how).coefficient;
    double error = 0;
    for (std::size_t i = 0; i < coded.size(); ++i)
      error += std::pow(static_cast<double>(coded[i] - products.coefficient[i]), 2);
    const double bytes = coded_bytes(coded, 3, 32);
    CHECK(bytes < last);
    CHECK(error > last_error);
    last = bytes;
    last_error = error;
  }
}

TEST_CASE("the size of a layer is known before it is written") {
  const test::Folder folder;
  Fabric fabric = test::random_fabric(32, 32, {8, 8}, 1, 3);
  fabric.levels.resize(1);
  const std::vector<float> opacity = fabric.levels[0][LayerKind::opacity].values;
  REQUIRE(write_fabric(folder / "with.exr", fabric));
  fabric.levels[0].remove_layer(LayerKind::opacity);
  REQUIRE(write_fabric(folder / "without.exr", fabric));
  // The part has 64 channels in the header, and the previews differ.
  const auto difference = static_cast<double>(std::filesystem::file_size(folder / "with.exr")) -
                          static_cast<double>(std::filesystem::file_size(folder / "without.exr"));
  CHECK(coded_bytes(opacity, 64, 32) == doctest::Approx(difference - 64 * 30).epsilon(0.05));
}

TEST_CASE("texels that are products of few functions are found again") {
  const DirectionGrid views{4, 4};
  const DirectionGrid lights{4, 3};
  Random random(2);
  std::vector<SampleLevel> levels;
  for (const int width : {4, 2}) {
    SampleLevel level{.width = width, .height = width, .views = views.count(), .lights = lights.count()};
    level.normal_sum.assign(width * width, V3f(0, 0, 1));
    for (int texel = 0; texel < width * width; ++texel) {
      const auto a = static_cast<float>(random.uniform());
      const auto b = static_cast<float>(random.uniform());
      for (const V3f& v : cell_directions(views)) {
        level.alpha.push_back(level.alpha.size() % 16 == 5 ? 0.0F : a);  // one view sees holes
        for (const V3f& l : cell_directions(lights))
          level.radiance.emplace_back(a * l.z * (1 + v.x) + b * v.z * (l.y + 1), a * l.z * (1 + v.x),
                                      b * v.z);
      }
    }
    levels.push_back(level);
  }
  const std::vector<BasisFit> fitted = texel_basis(levels, lights, 6, 8);
  for (std::size_t k = 0; k < levels.size(); ++k) {
    const SampleLevel& level = levels[k];
    double error = 0;
    double energy = 0;
    for (std::size_t row = 0; row < level.alpha.size(); ++row) {
      const std::size_t texel = row / 16;
      for (int l = 0; l < 12; ++l) {
        for (int c = 0; c < 3; ++c) {
          double f = 0;
          for (std::size_t m = 0; m < fitted[k].pairs.size(); ++m) {
            const V2i pair = fitted[k].pairs[m];
            f +=
                static_cast<double>(fitted[k].coefficient[texel * fitted[k].pairs.size() + m] *
                                    fitted[k].view_functions[pair.x][row % 16] * cell_direction(lights, l).z *
                                    fitted[k].light_functions[pair.y][static_cast<std::size_t>(3 * l + c)]);
          }
          const auto alpha = static_cast<double>(level.alpha[row]);
          const auto truth = static_cast<double>(level.radiance[row * 12 + static_cast<std::size_t>(l)][c]);
          error += alpha * alpha * (f - truth) * (f - truth);
          energy += alpha * alpha * truth * truth;
        }
      }
    }
    CHECK(std::sqrt(error / energy) < 0.01);  // the functions' rounding, and a slight pull towards 0
  }
}
