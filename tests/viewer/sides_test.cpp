// Both sides of the cloth, and light that comes through it: beside closed forms, and beside the cloth turned
// over.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "format/base/random.h"
#include "format/cells/cell_texels.h"
#include "format/fabric/evaluate.h"
#include "format/picture/environment.h"
#include "tests/format/fabrics.h"
#include "tests/format/yarn_data.h"
#include "tests/viewer/paths.h"
#include "tests/viewer/shapes.h"
#include "viewer/light/shadows.h"

using namespace selvedge;

namespace {

/// The fabrics make(0) ... make(3) as front and other sides, with light through the yarn, if there is any.
template <class Make>
Fabric sided_fabric(const Make& make) {
  Fabric fabric = make(0);
  if (const auto yarns = fabric.levels.front().yarns()) {
    YarnData data = yarns->data();
    data.light_through = data.station_light;
    for (std::size_t i = 0; i < data.light_through.size(); ++i)
      data.light_through[i] = 0.02F * static_cast<float>(i % 7) - 0.01F;
    fabric.levels.front().set_yarns(std::make_shared<const Yarns>(std::move(data), fabric.period_mm));
  }
  for (const Side side : other_sides) {
    Fabric other = make(static_cast<int>(index_of(side)));
    other.side = side;
    other.levels.front().set_yarns(nullptr);
    fabric.add_side(std::move(other));
  }
  return fabric;
}

constexpr std::array paths{RenderPath::hybrid, RenderPath::raster};

/// Albedos of the sides, in their order.
constexpr std::array<float, 4> albedo{0.5F, 0.3F, 0.2F, 0.1F};

/// A square of cloth upright, seen from in front or from behind.
test::Setting curtain(Fabric fabric, bool from_behind) {
  test::Setting setting;
  test::add(setting.scene, test::square(1), test::material(0));
  setting.fabrics.push_back(std::move(fabric));
  setting.scene.fabrics.resize(1);
  setting.camera.azimuth = from_behind ? 180 : 0;
  setting.options.width = setting.options.height = 48;
  return setting;
}

Fabric matt_fabric() {
  return sided_fabric([](int side) { return test::lambert_fabric(2, V3f(albedo[side])); });
}

float middle_of(const test::Setting& setting, RenderPath path) {
  const Frame frame = test::drawn(setting, path);
  return frame.pixels[frame.width * frame.height / 2 + frame.width / 2].x;
}

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
  return sided_fabric([&](int side) {
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

TEST_CASE("a lamp on either side of matt cloth gives the radiance of its closed form on either side") {
  const V3d towards = V3d(0.3, 0.2, 0.6).normalized();
  for (const bool is_view_behind : {false, true}) {
    for (const bool light_behind : {false, true}) {
      test::Setting setting = curtain(matt_fabric(), is_view_behind);
      setting.options.lights = {{light_behind ? -towards : towards, V3f(2)}};
      const Side side = is_view_behind == light_behind ? (is_view_behind ? Side::back : Side::front)
                        : is_view_behind               ? Side::back_through
                                                       : Side::through;
      const double expected =
          static_cast<double>(albedo[index_of(side)]) / std::numbers::pi * 2 * std::abs(towards.z);
      for (const RenderPath path : paths) {
        setting.options.shadow_map_size = 0;
        CHECK(middle_of(setting, path) == doctest::Approx(expected).epsilon(1e-4));
        // The cloth does not stand in its own light, but something else behind it does.
        setting.options.shadow_map_size = 256;
        CHECK(middle_of(setting, path) == doctest::Approx(expected).epsilon(1e-4));
        test::Setting hidden = setting;
        test::add(hidden.scene, test::square(1, light_behind ? -0.1F : 0.1F), test::material(-1));
        if (light_behind != is_view_behind) CHECK(middle_of(hidden, path) == 0);
      }
    }
  }
}

TEST_CASE("matt cloth in even light shows what it reflects and what it lets through") {
  const Environment even{16, 8, std::vector<V3f>(128, V3f(1, 1, 1)), {}};
  const EnvironmentLight light = split_light(even);
  for (const bool behind : {false, true}) {
    test::Setting setting = curtain(matt_fabric(), behind);
    setting.options.lights = light.lamps;
    setting.options.smooth_light = light.smooth_light;
    setting.options.shadow_map_size = 256;
    for (const RenderPath path : paths)
      CHECK(middle_of(setting, path) == doctest::Approx(behind ? 0.4 : 0.7).epsilon(1e-3));
  }
}

TEST_CASE("cloth without a back of its own shows the front in a mirror, and lets the same light through") {
  Fabric fabric = test::lambert_fabric(2, V3f(0.5F));
  Fabric through = test::lambert_fabric(2, V3f(0.2F));
  through.side = Side::through;
  fabric.add_side(through);
  for (const bool light_behind : {false, true}) {
    for (const RenderPath path : paths) {
      test::Setting setting = curtain(fabric, true);
      setting.options.lights = {{V3d(0, 0, light_behind ? -1 : 1), V3f(std::numbers::pi_v<float>)}};
      CHECK(middle_of(setting, path) == doctest::Approx(light_behind ? 0.5 : 0.2).epsilon(1e-4));
    }
  }
}

TEST_CASE("cloth from behind is the cloth turned over and seen from in front, in a mirror") {
  const auto check = [](const Fabric& fabric) {
    for (const RenderPath path : paths) {
      test::Setting behind = curtain(fabric, true);
      behind.options.lights = {{V3d(0.48, 0.6, 0.64), V3f(3, 2, 1)}, {V3d(-0.6, 0, -0.8), V3f(1, 1, 2)}};
      SmoothLight& around = behind.options.smooth_light.emplace();
      for (std::size_t k = 0; k < 4; ++k) around.coefficients[k] = V3f(0.3F - 0.06F * static_cast<float>(k));
      test::Setting front = curtain(turned_over(fabric), false);
      front.options = behind.options;
      for (Light& light : front.options.lights) light.direction.z *= -1;
      front.options.smooth_light->coefficients[3] *= -1;
      const Frame a = test::drawn(behind, path);
      const Frame b = test::drawn(front, path);
      int apart = 0;
      float brightest = 0;
      for (int i = 0; i < a.width * a.height; ++i) {
        const V4f& left = a.pixels[i];
        const V4f& right = b.pixels[i / a.width * a.width + a.width - 1 - i % a.width];
        brightest = std::max(brightest, left.x);
        bool same = true;
        for (int c = 0; c < 4; ++c) same &= std::abs(left[c] - right[c]) <= 1e-3F * (1 + left[c]);
        apart += same ? 0 : 1;
      }
      CHECK(brightest > 0.1F);
      // Points at edges of yarn take either side.
      CHECK(apart <= a.width * a.height / 100);
    }
  };
  SUBCASE("lobes, frames, tables, opacity and products") {
    check(sided_fabric([](int side) { return test::random_product_fabric(8, 8, {4, 4}, 1, 20 + 3 * side); }));
  }
  SUBCASE("yarn") {
    check(sided_fabric([](int side) {
      return test::with_yarn(test::random_fabric(2, 2, {4, 4}, 1, 20 + 3 * side), 3);
    }));
  }
}

TEST_CASE("hybrid and rays agree on yarn that is lit on both sides, in shadows, too") {
  // A few repeats: patches of one repeat are flat, and rays nearly parallel.
  const auto waves = [](int number) {
    Fabric fabric = test::random_fabric(2, 2, {4, 4}, 1, 20 + 3 * number);
    fabric.period_mm = {3, 3};
    fabric.reference_height = 0.6F;
    fabric.levels.front().set_yarns(
        std::make_shared<const Yarns>(test::waves(3, 4, false), fabric.period_mm));
    return fabric;
  };
  for (const bool from_behind : {false, true}) {
    test::Setting setting = curtain(sided_fabric(waves), from_behind);
    setting.scene = {};
    test::add(setting.scene, test::square(4), test::material(0));
    setting.scene.fabrics.resize(1);
    setting.options.width = setting.options.height = 120;
    setting.options.lights = {{V3d(0.48, 0.6, 0.64), V3f(3, 2, 1)}, {V3d(-0.6, 0, -0.8), V3f(1, 1, 2)}};
    for (const int shadows : {setting.options.shadow_map_size, 256}) {
      setting.options.shadow_map_size = shadows;
      CHECK(test::decibels_to_rays(setting) > 19);  // edges of rays
    }
  }
}

TEST_CASE("texels of cell images agree with the reference evaluation, whatever the layers") {
  for (const Case& example : cases()) {
    CAPTURE(example.name);
    double brightest = 0;
    CHECK(worst_texel(example, brightest) < 2e-5);
    CHECK((example.lights == 0 || brightest > 0.1));
  }
}
