#include "fitter/products/quantise.h"

#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>

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
