// The formula of a texel in cell images beside the reference (format/fabric/evaluate.h).
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "format/base/random.h"
#include "format/cells/cell_texels.h"
#include "format/fabric/evaluate.h"
#include "tests/format/fabrics.h"
#include "tests/viewer/shapes.h"
#include "tests/viewer/sided_fabric.h"

namespace selvedge {
namespace {

using test::random_fabric;
using test::random_product_fabric;

Fabric without(Fabric fabric, std::initializer_list<LayerKind> kinds, float radiance_scale = 1) {
  fabric.radiance_scale = radiance_scale;
  for (FabricLevel& level : fabric.levels)
    for (const LayerKind kind : kinds) level.remove_layer(kind);
  return fabric;
}

Fabric with_other_layers_by_level() {
  Fabric fabric = random_fabric(8, 8, {4, 4}, 2, 9);
  fabric.levels[1].remove_layer(LayerKind::table);
  std::vector<float> lobes = fabric.levels[2][LayerKind::lobes].values;
  lobes.resize(fabric.levels[2].texels() * 15);
  fabric.levels[2].set_layer(LayerKind::lobes, {15, std::move(lobes)});
  return fabric;
}

/// Products alone of which nothing is negative.
Fabric positive_products() {
  Fabric fabric = without(random_product_fabric(8, 4, {4, 6}, 2, 3),
                          {LayerKind::lobes, LayerKind::table, LayerKind::light});
  ProductBases bases = *fabric.levels.front().bases;
  for (float& value : bases.view) value = std::abs(value);
  for (V3f& value : bases.light) value = V3f(std::abs(value.x), std::abs(value.y), std::abs(value.z));
  const auto shared = std::make_shared<const ProductBases>(std::move(bases));
  for (FabricLevel& level : fabric.levels) {
    level.bases = shared;
    std::vector<float> values(level.coefficients().begin(), level.coefficients().end());
    for (float& value : values) value = std::abs(value);
    level.set_layer(LayerKind::products, {static_cast<int>(level.pairs.size()), std::move(values)});
  }
  return fabric;
}

Fabric lit_on_both_sides(bool products_alone) {
  return test::sided_fabric([&](int side) {
    Fabric fabric = random_product_fabric(8, 4, {4, 6}, 2, 30 + side);
    if (products_alone)
      fabric = without(fabric, {LayerKind::lobes, LayerKind::frame, LayerKind::table, LayerKind::light});
    fabric.radiance_scale = 1 + static_cast<float>(side);
    return fabric;
  });
}

struct Case {
  std::string name;
  Fabric fabric;
  std::size_t lights = 2;
};

std::vector<Case> cases() {
  const Fabric lobes = random_fabric(8, 4, {4, 6}, 2, 3);
  const Fabric products = random_product_fabric(8, 4, {4, 6}, 2, 3);
  return {
      {"lobes, frame, table, opacity", lobes},
      {"no table", without(lobes, {LayerKind::table})},
      {"no opacity, scaled", without(lobes, {LayerKind::opacity}, 0.25F)},
      {"lobes alone", without(lobes, {LayerKind::table, LayerKind::opacity, LayerKind::frame})},
      {"light table and products", products},
      {"products alone", without(products, {LayerKind::lobes, LayerKind::table, LayerKind::light})},
      {"positive products", positive_products(), 11},
      {"no lobes", random_fabric(4, 4, {3, 3}, 0, 5), 3},
      {"five lobes, one view", random_fabric(4, 4, {1, 1}, 5, 5), 1},
      {"many lights", random_product_fabric(4, 4, {8, 8}, 1, 5), 19},
      {"no light", random_fabric(4, 4, {3, 3}, 2, 5), 0},
      {"one texel, four lobes", random_fabric(1, 1, {3, 3}, 4, 4)},
      {"levels with different layers", with_other_layers_by_level(), 2},
      {"both sides", lit_on_both_sides(false), 11},
      {"both sides turned over", turned_over(lit_on_both_sides(false)), 11},
      {"both sides, products alone", lit_on_both_sides(true), 11},
      {"both sides, products alone, turned over", turned_over(lit_on_both_sides(true)), 11},
  };
}

/// Largest difference of a level's texels in cell images to the reference, relative to 1 + radiance. Lamps
/// shine from both sides, into two planes.
double worst_texel(const Case& example, double& brightest) {
  const CellTexels texels(example.fabric);
  double worst = 0;
  for (std::uint64_t number = 0; number < 20; ++number) {
    Random random(7, number);
    CellView view;
    view.plane_count = 2;
    view.view = test::any_direction(random);
    view.view.z = std::abs(view.view.z) + 0.01F;
    view.view.normalize();
    for (std::size_t i = 0; i < example.lights; ++i)
      view.lamps.push_back({test::any_direction(random), V3f(1, 2, 0.5F), static_cast<int>(i % 2)});
    for (std::size_t level = 0; level < example.fabric.levels.size(); ++level) {
      view.levels = {0, static_cast<int>(level), 0};
      view.size = texel_cell_size(example.fabric, {1e-6F, 1e-6F}, view.levels.finer_level);
      const V2i& size = view.size.repeat_samples;
      const std::size_t count = std::size_t{1} * size.x * size.y;
      std::vector<Group> samples(2 * count, Group{});
      texels.add_to_samples(view, samples);
      for (std::size_t i = 0; i < count; ++i) {
        const auto by_reference = [&](const V3f& l) {
          return evaluate(example.fabric, view.levels.finer_level, static_cast<int>(i) % size.x,
                          size.y - 1 - static_cast<int>(i) / size.x, l, view.view);
        };
        const float alpha = by_reference(V3f(0, 0, 1)).alpha;
        worst = std::max(worst, static_cast<double>(std::abs(alpha - samples[2 * i][3])));
        std::array<V3f, 2> expected{V3f(0, 0, 0), V3f(0, 0, 0)};
        for (const CellLamp& lamp : view.lamps)
          expected[lamp.plane] += by_reference(lamp.direction).radiance * lamp.irradiance * alpha;
        for (int c = 0; c < 6; ++c) {
          const float value = expected[c / 3][c % 3];
          const float found = samples[2 * i + c / 3][c % 3];
          brightest = std::max(brightest, static_cast<double>(value));
          worst = std::max(worst, static_cast<double>(std::abs(value - found) / (1 + value)));
        }
      }
    }
  }
  return worst;
}

}  // namespace

TEST_CASE("texels of cell images agree with the reference evaluation, whatever the layers") {
  for (const Case& example : cases()) {
    CAPTURE(example.name);
    double brightest = 0;
    CHECK(worst_texel(example, brightest) < 2e-5);
    CHECK((example.lights == 0 || brightest > 0.1));
  }
}

}  // namespace selvedge
