// Both sides of the cloth, and light that comes through it: beside closed forms, and beside the cloth turned
// over.
#include <doctest/doctest.h>

#include <numbers>

#include "format/picture/environment.h"
#include "tests/format/fabrics.h"
#include "tests/format/yarn_data.h"
#include "tests/viewer/paths.h"
#include "tests/viewer/sided_fabric.h"
#include "viewer/light/shadows.h"

using namespace selvedge;

namespace {

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
  return test::sided_fabric([](int side) { return test::lambert_fabric(2, V3f(albedo[side])); });
}

float middle_of(const test::Setting& setting, RenderPath path) {
  const Frame frame = test::drawn(setting, path);
  return frame.pixels[frame.width * frame.height / 2 + frame.width / 2].x;
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
    check(test::sided_fabric([](int side) {
      return test::random_product_fabric(8, 8, {4, 4}, 1, 20 + 3 * side);
    }));
  }
  SUBCASE("yarn") {
    check(test::sided_fabric([](int side) {
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
    test::Setting setting = curtain(test::sided_fabric(waves), from_behind);
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
