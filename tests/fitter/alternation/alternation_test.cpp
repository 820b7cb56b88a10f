// Sums of products beside lobes and tables, all fitted by turns.
#include "fitter/alternation/alternation.h"

#include <doctest/doctest.h>

#include <cmath>
#include <functional>

#include "format/base/parallel.h"
#include "format/base/random.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"
#include "format/fabric/lafortune.h"
#include "tests/format/files.h"

using namespace selvedge;

namespace {

using Radiance = std::function<V3f(int texel, const V3f& light, const V3f& view)>;

struct Made {
  SamplesHeader header;
  SampleLevel level;
};

Made made_of(const Radiance& radiance, int width = 4, const DirectionGrid& views = {6, 6},
             const DirectionGrid& lights = {6, 6}) {
  Made made;
  made.header.width = made.level.width = width;
  made.header.height = made.level.height = 1;
  made.header.views = views;
  made.header.lights = lights;
  made.level.views = views.count();
  made.level.lights = lights.count();
  for (int t = 0; t < width; ++t) {
    made.level.normal.emplace_back(0.0F, 0.0F, 1.0F);
    for (const V3f& v : directions_of(views)) {
      made.level.alpha.push_back(1);
      for (const V3f& l : directions_of(lights)) made.level.radiance.push_back(radiance(t, l, v));
    }
  }
  return made;
}

FitOptions with_products(int products, int lobes = 1) {
  FitOptions options;
  options.lobes = lobes;
  options.products = products;
  return options;
}

FitResult fitted(const Made& made, const FitOptions& options) {
  const auto result = fit(made.level, made.header, options);
  REQUIRE_MESSAGE(result, to_line(result.error()));
  const auto valid = validate(result->fabric);
  CHECK_MESSAGE(valid, (valid ? "" : to_line(valid.error())));
  return *result;
}

/// A lobe with shadows that move with view and light, of another strength in every texel.
V3f shadowed(int texel, const V3f& l, const V3f& v) {
  const std::array<float, 5> parameters{0.2F, -0.6F, -0.7F, 0.9F, 4};
  const float g = lafortune(parameters.data(), 1, &l.x, &v.x);
  const float strength = 0.25F * static_cast<float>(texel + 1);
  return g * (V3f(1, 1, 1) + strength * v.x * l.x * V3f(1, 0.5F, 0.25F));
}

/// Shadows, and a random factor on every sample.
Made noisy() {
  Made made = made_of(shadowed);
  Random random(5);
  for (V3f& r : made.level.radiance) r *= static_cast<float>(random.uniform());
  return made;
}

/// Relative L2 of level 0 over the samples' own directions.
double error_of(const Fabric& fabric, const Made& made, float factor = 1) {
  double error = 0;
  double energy = 0;
  std::size_t i = 0;
  for (int t = 0; t < made.header.width; ++t) {
    for (const V3f& v : directions_of(made.header.views)) {
      for (const V3f& l : directions_of(made.header.lights)) {
        const V3d truth(made.level.radiance[i++]);
        const Shading seen = evaluate(fabric, 0, t, 0, l, v);
        error += (V3d(seen.radiance / factor) - truth).length2();
        energy += truth.length2();
      }
    }
  }
  return energy > 0 ? std::sqrt(error / energy) : std::sqrt(error);
}

bool has_products(const Fabric& fabric) {
  for (const FabricLevel& level : fabric.levels) {
    if (level.products) return true;
  }
  return false;
}

}  // namespace

TEST_CASE("samples made of lobes times a sum of products come back") {
  const Made made = made_of(shadowed);
  const double without = error_of(fitted(made, with_products(0)).fabric, made);
  const FitResult with = fitted(made, with_products(1));
  CHECK(without > 0.05);
  // What is left is the pulls' doing: of the table and of the products, each 5 % of a mean sample.
  CHECK(error_of(with.fabric, made) < 0.3 * without);
  REQUIRE(with.fabric.levels[0].products);
  CHECK(with.fabric.levels[0].products->pairs.size() == 1);
  for (const FitLevelReport& level : with.levels) CHECK(level.training_error < 0.02);
}

TEST_CASE("the report's training error is that of the fabric, but for the coefficients' rounding") {
  const Made made = noisy();
  const FitResult with = fitted(made, with_products(3));
  CHECK(error_of(with.fabric, made) == doctest::Approx(with.levels[0].training_error).epsilon(0.01));
}

TEST_CASE("a turn never makes the cost larger, and it ends below that without products") {
  const Made made = noisy();
  for (const bool light_table : {false, true}) {
    FitOptions options = with_products(0);
    options.light_table = light_table;
    FitResult result = fitted(made, options);
    const std::vector<FitLevelReport> without = result.levels;
    double error_before = error_of(result.fabric, made);
    options.products = 4;
    const std::vector<ProductTrace> traces = add_products(made.level, made.header, options, result, {});
    REQUIRE(traces.size() == result.levels.size());
    for (std::size_t k = 0; k < traces.size(); ++k) {
      double last = traces[k].without;
      CHECK(traces[k].costs.size() >= 4);
      for (const double cost : traces[k].costs) {
        CHECK(cost <= last);
        last = cost;
      }
      CHECK(traces[k].stored <= traces[k].without);
      CHECK(result.levels[k].cost <= without[k].cost);
      CHECK(result.levels[k].training_error < without[k].training_error);
    }
    CHECK(error_of(result.fabric, made) < error_before);
  }
}

TEST_CASE("the cost falls with the number of products") {
  const Made made = noisy();
  double last = fitted(made, with_products(0)).levels[0].cost;
  for (const int products : {1, 4, 16}) {
    const double cost = fitted(made, with_products(products)).levels[0].cost;
    CHECK(cost < last);
    last = cost;
  }
}

TEST_CASE("lobes without a table keep the 1 beside their products, as one more of them") {
  const Made made = made_of(shadowed);
  FitOptions options = with_products(1);
  options.view_table = false;
  const FitResult with = fitted(made, options);
  CHECK_FALSE(with.fabric.levels[0].view_table);
  REQUIRE(with.fabric.levels[0].products);
  CHECK(with.fabric.levels[0].products->pairs.size() == 2);
  CHECK(error_of(with.fabric, made) < 0.03);
}

TEST_CASE("products beside lobes are the same bytes for any number of threads") {
  const Made made = noisy();
  std::vector<Fabric> fabrics;
  for (const int threads : {1, 2, 5}) {
    set_threads(threads);
    fabrics.push_back(fitted(made, with_products(3)).fabric);
  }
  set_threads(0);
  for (const Fabric& fabric : fabrics) {
    for (std::size_t k = 0; k < fabric.levels.size(); ++k) {
      const FabricLevel& a = fabric.levels[k];
      const FabricLevel& b = fabrics.front().levels[k];
      CHECK(a.lobes->parameters == b.lobes->parameters);
      CHECK(a.view_table->colour == b.view_table->colour);
      REQUIRE(a.products);
      CHECK(a.products->pairs == b.products->pairs);
      CHECK(a.products->coefficient == b.products->coefficient);
      CHECK(a.bases->view == b.bases->view);
      CHECK(a.bases->light == b.bases->light);
    }
  }
}

TEST_CASE("products beside lobes scale with the radiance, in half precision too") {
  const Made made = noisy();
  const double truth = error_of(fitted(made, with_products(3)).fabric, made);
  const test::Folder folder;
  for (const float factor : {1e-8F, 1.0F, 1e8F}) {
    Made scaled = made;
    for (V3f& r : scaled.level.radiance) r *= factor;
    const Fabric fabric = fitted(scaled, with_products(3)).fabric;
    FabricWriteOptions options;
    options.half = LayerSet::all();
    CHECK(precision_warnings("x", fabric, options).empty());
    REQUIRE(write_fabric(folder / "x.exr", fabric, options));
    const auto read = read_fabric(folder / "x.exr");
    REQUIRE(read);
    REQUIRE(read->levels[0].products);
    CHECK(error_of(*read, made, factor) == doctest::Approx(truth).epsilon(0.01));
  }
}

TEST_CASE("all black has no products") {
  const FitResult result =
      fitted(made_of([](int, const V3f&, const V3f&) { return V3f(0, 0, 0); }), with_products(4));
  CHECK_FALSE(has_products(result.fabric));
  CHECK(evaluate(result.fabric, 0, 1, 0, V3f(0, 0, 1), V3f(0, 0, 1)).radiance == V3f(0, 0, 0));
}

TEST_CASE("where the lobes are dark the products do not explode") {
  // One bright pair of directions of which no lobe and no table can be, among black ones.
  Made made = made_of([](int, const V3f&, const V3f&) { return V3f(0, 0, 0); });
  made.level.radiance[700] = {1, 1, 1};
  const Fabric fabric = fitted(made, with_products(4)).fabric;
  for (const V3f& light : directions_of({17, 17})) {
    for (const V3f& view : directions_of({17, 17})) {
      CHECK(evaluate(fabric, 0, 0, 0, light, view).radiance.x < 4);
    }
  }
}

TEST_CASE("one view, one light, holes and too few samples leave products finite") {
  SUBCASE("one view") { fitted(made_of(shadowed, 3, {1, 1}, {6, 6}), with_products(4)); }
  SUBCASE("one light") { fitted(made_of(shadowed, 3, {6, 6}, {1, 1}), with_products(4)); }
  SUBCASE("one of each") { fitted(made_of(shadowed, 2, {1, 1}, {1, 1}), with_products(16)); }
  SUBCASE("one texel") { fitted(made_of(shadowed, 1), with_products(16)); }
  SUBCASE("holes") {
    Made made = made_of(shadowed);
    for (std::size_t v = 0; v < 36; ++v) made.level.alpha[v] = 0;
    for (std::size_t v = 36; v < 72; ++v) made.level.alpha[v] = v == 50 ? 1.0F : 0.0F;
    const Fabric fabric = fitted(made, with_products(4)).fabric;
    CHECK(evaluate(fabric, 0, 0, 0, V3f(0, 0, 1), V3f(0, 0, 1)).alpha == 0);
  }
  SUBCASE("a range of 1e6") {
    const Made made = made_of([](int, const V3f& l, const V3f& v) {
      const float lobe = std::pow(std::max(0.0F, -l.x * v.x - l.y * v.y + l.z * v.z), 40.0F);
      return V3f(1e-3F + 1e3F * lobe) * l.z;
    });
    CHECK(error_of(fitted(made, with_products(4)).fabric, made) < 0.02);
  }
  SUBCASE("without any pull") {
    FitOptions options = with_products(16, 2);
    options.table = {0, 0};
    fitted(noisy(), options);
  }
  SUBCASE("no lobes, normals fitted, a table over lights as well") {
    FitOptions options = with_products(4, 0);
    options.frames = options.light_table = true;
    fitted(made_of(shadowed), options);
  }
}

TEST_CASE("random samples: nothing that products give is infinite or no number") {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Random random(seed);
    Made made = made_of(
        [&](int, const V3f&, const V3f&) {
          const auto value = [&] {
            const double u = random.uniform();
            return u < 0.3 ? 0.0F : static_cast<float>(std::pow(10.0, 20 * random.uniform() - 10));
          };
          return V3f(value(), value(), value());
        },
        3, {3, 3}, {3, 3});
    for (float& alpha : made.level.alpha) alpha = random.uniform() < 0.3 ? 0.0F : alpha;
    const Fabric fabric = fitted(made, with_products(1 + static_cast<int>(seed % 16))).fabric;
    for (const DirectionPair& pair : random_pairs(50, 0.01, seed)) {
      const V3f r = evaluate(fabric, 0, 0, 0, pair.light, pair.view).radiance;
      CHECK(std::isfinite(r.x + r.y + r.z));
    }
  }
}

TEST_CASE("a number of products that no fabric can have is refused") {
  const Made made = made_of(shadowed);
  for (const int products : {-1, max_products + 1}) {
    const auto result = fit(made.level, made.header, with_products(products));
    REQUIRE_FALSE(result);
    CHECK(result.error().code == Code::option_out_of_range);
    CHECK(result.error().place == "products");
  }
}
