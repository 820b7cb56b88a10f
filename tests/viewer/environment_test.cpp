// Fabrics and core materials in light from all around, beside closed forms and beside the sum over lamps.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "format/picture/environment.h"
#include "format/picture/image.h"
#include "tests/format/lamps.h"
#include "tests/viewer/paths.h"
#include "viewer/light/reflections.h"
#include "viewer/light/shadows.h"
#include "viewer/renderer.h"

using namespace selvedge;

namespace {

/// Bright above and on one side, in colours; without lamps.
Environment evening() {
  Environment e{64, 32, {}, {}};
  for (int y = 0; y < e.height; ++y) {
    for (int x = 0; x < e.width; ++x) {
      const V3d d = e.direction(x, y);
      const double rise = 0.3 + 0.7 * std::max(0.0, d.y) + 0.5 * std::max(0.0, d.x + d.z);
      e.radiance.emplace_back(V3d(rise, 0.3 + 0.2 * rise, 0.5 - 0.3 * d.y) / std::numbers::pi);
    }
  }
  return e;
}

constexpr std::array paths{RenderPath::hybrid, RenderPath::raster};

test::Setting placed_in(test::Setting setting, const Environment& environment) {
  const EnvironmentLight light = split_light(environment);
  setting.options.lights = light.lamps;
  setting.options.smooth_light = light.smooth_light;
  setting.options.environment = std::make_shared<const Environment>(environment);
  return setting;
}

Frame in_environment(const test::Setting& setting, const Environment& environment, RenderPath path) {
  return test::drawn(placed_in(setting, environment), path);
}

/// The same as lamps, one for each pixel.
Frame in_lamps(test::Setting setting, const Environment& environment) {
  setting.options.lights = test::lamps_of(environment);
  return test::drawn(setting, RenderPath::hybrid);
}

/// Mean of a colour.
double mean_of(const Frame& frame, unsigned colour) {
  double sum = 0;
  for (const V4f& pixel : frame.pixels) sum += static_cast<double>(pixel[colour]);
  return sum / static_cast<double>(frame.pixels.size());
}

/// PSNR in dB of what a display shows, of the pixels with cloth.
double likeness(const Frame& a, const Frame& b) {
  double sum = 0;
  double count = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    if (!(a.pixels[i].w > 0)) continue;
    for (unsigned c = 0; c < 3; ++c) {
      const double d = (test::shown(a.pixels[i][c]) - test::shown(b.pixels[i][c])) / 255;
      sum += d * d;
    }
    count += 3;
  }
  REQUIRE(count > 1000);
  return -10 * std::log10(sum / count);
}

test::Setting ball(Fabric fabric) {
  test::Setting setting;
  test::add(setting.scene, test::sphere(40, 20, {6, 3}), test::material(0));
  setting.fabrics.push_back(std::move(fabric));
  setting.scene.fabrics.resize(1);
  setting.options.width = setting.options.height = 40;
  return setting;
}

/// The same without a fabric.
test::Setting core_ball(float metallic, float roughness, const V4f& colour = V4f(1)) {
  test::Setting setting;
  SceneMaterial material = test::material(-1, colour);
  material.metallic = metallic;
  material.roughness = roughness;
  test::add(setting.scene, test::sphere(256, 128, {1, 1}), material);
  setting.options.width = setting.options.height = 40;
  return setting;
}

Environment even_light() { return {16, 8, std::vector<V3f>(128, V3f(1, 1, 1)), {}}; }

/// Products alone, as the presets make them: shadowed on one side, and seen better from the other.
Fabric product_fabric() {
  Fabric fabric;
  fabric.views = {4, 4};
  fabric.lights = {6, 6};
  auto bases = std::make_shared<ProductBases>();
  for (int cell = 0; cell < fabric.views.count(); ++cell)
    bases->view.push_back(0.5F + cell_direction(fabric.views, cell).x);
  for (int b = 0; b < 2; ++b) {
    for (int cell = 0; cell < fabric.lights.count(); ++cell) {
      const V3f l = cell_direction(fabric.lights, cell);
      bases->light.push_back(b == 0 ? V3f(0.2F, 0.15F, 0.1F) : V3f(0.1F * l.x, 0.1F * l.y, 0.1F * l.x * l.y));
    }
  }
  for (int k = 0; k < level_count(4, 4); ++k) {
    FabricLevel level;
    level.width = level.height = level_size(4, k);
    level.pairs = {V2i(0, 0), V2i(0, 1), V2i(1, 1)};
    level.bases = bases;
    Layer products{3, {}};
    for (int i = 0; i < level.texels(); ++i) {
      const auto part = static_cast<float>(i) / static_cast<float>(level.texels());
      products.values.insert(products.values.end(), {0.5F + part, 1 - part, part});
    }
    level.set_layer(LayerKind::products, std::move(products));
    fabric.levels.push_back(std::move(level));
  }
  return fabric;
}

/// Two yarns along each axis that go over and under each other, in a cell of 4 x 4 mm.
YarnData weave() {
  constexpr int nodes = 24;
  YarnData data;
  for (int yarn = 0; yarn < 4; ++yarn) {
    YarnCurve curve;
    curve.nodes = curve.stations = nodes;
    curve.repeat_offset = yarn < 2 ? V2i(1, 0) : V2i(0, 1);
    curve.radius = 0.6F;
    curve.albedo = yarn < 2 ? V3f(0.7F, 0.5F, 0.4F) : V3f(0.2F, 0.4F, 0.6F);
    curve.gloss = {0.1F, 0.5F};
    data.curves.push_back(curve);
    for (int i = 0; i < nodes; ++i) {
      const float along = 4.0F * static_cast<float>(i) / nodes;
      const float side = yarn % 2 == 0 ? 1.0F : 3.0F;
      const float sign = (yarn < 2) == (yarn % 2 == 0) ? 1.0F : -1.0F;
      const float z = 1.2F + 0.6F * sign * std::sin(std::numbers::pi_v<float> * along / 2);
      data.nodes.push_back(yarn < 2 ? V3f(along, side, z) : V3f(side, along, z));
    }
  }
  data.station_light.assign(std::size_t{4} * nodes * light_values_per_station, 0.0F);
  return data;
}

Fabric yarn_fabric() {
  Fabric fabric = product_fabric();
  fabric.period_mm = V2f(4, 4);
  fabric.reference_height = 1.2F;
  fabric.levels.front().set_yarns(std::make_shared<const Yarns>(weave(), fabric.period_mm));
  return fabric;
}

}  // namespace

TEST_CASE("fabrics in an environment look as in one lamp for each of its pixels") {
  const Environment environment = evening();
  REQUIRE(split_light(environment).lamps.empty());
  const auto check = [&](Fabric fabric, double least) {
    const test::Setting setting = ball(std::move(fabric));
    const Frame lamps = in_lamps(setting, environment);
    for (const RenderPath path : paths) {
      const Frame frame = in_environment(setting, environment, path);
      const double dB = likeness(frame, lamps);
      MESSAGE(path_names[static_cast<std::size_t>(path)], " dB: ", dB);
      CHECK(dB > least);
      for (unsigned c = 0; c < 3; ++c)
        CHECK(mean_of(frame, c) == doctest::Approx(mean_of(lamps, c)).epsilon(0.02));
    }
  };
  SUBCASE("products") { check(product_fabric(), 50); }
  SUBCASE("lobes, frames, tables and opacity") { check(test::random_fabric(4, 4, 1), 40); }
  SUBCASE("yarn") { check(yarn_fabric(), 34); }
}

TEST_CASE("white core materials in even light cannot be seen, in an environment's or in ambient light") {
  for (const float metallic : {0.0F, 0.5F, 1.0F}) {
    for (const float roughness : {0.0F, 0.25F, 0.6F, 1.0F}) {
      CAPTURE(metallic);
      CAPTURE(roughness);
      test::Setting setting = core_ball(metallic, roughness);
      const bool is_ambient = metallic == 0.5F;
      if (is_ambient) {
        setting.options.smooth_light.emplace().coefficients[0] = V3f(1);
        setting.options.mirrored_ambient_irradiance = std::numbers::pi_v<float>;
      } else {
        setting = placed_in(setting, even_light());
      }
      for (const RenderPath path : paths) {
        for (const V4f& pixel : test::drawn(setting, path).pixels) {
          if (pixel.w < 1) continue;
          for (int c = 0; c < 3; ++c) REQUIRE(pixel[c] == doctest::Approx(1).epsilon(2e-3));
        }
      }
    }
  }
}

TEST_CASE("a perfect mirror shows the environment itself, turned and as bright as it is") {
  Environment environment = evening();
  environment.options = {70, 1.5};
  const test::Setting setting = core_ball(1, 0, V4f(0.8F, 0.6F, 0.4F, 1));
  const Camera camera = test::camera_of(setting);
  for (const RenderPath path : paths) {
    const Frame frame = in_environment(setting, environment, path);
    int compared = 0;
    for (int i = 0; i < frame.width * frame.height; ++i) {
      const V3d view = view_direction(camera, V2d((2.0 * (i % frame.width) + 1) / frame.width - 1,
                                                  1 - (2.0 * (i / frame.width) + 1) / frame.height));
      const double along = camera.position.dot(view);
      const double root = along * along - camera.position.length2() + 1;
      if (root < 0.1) continue;
      const V3d normal = camera.position - view * (along - std::sqrt(root));
      const V3f seen = environment.radiance_at((normal * (2 * normal.dot(view)) - view).normalized());
      // Schlick's term, at the angle of a mirror.
      const double schlick = std::pow(1 - normal.dot(view), 5);
      const V3d f0(0.8, 0.6, 0.4);
      for (int c = 0; c < 3; ++c) {
        const double expected = static_cast<double>(seen[c]) * (f0[c] + (1 - f0[c]) * schlick);
        CHECK(frame.pixels[i][c] == doctest::Approx(expected).epsilon(0.02));
      }
      ++compared;
    }
    CHECK(compared > 300);
  }
}

TEST_CASE(
    "an occlusion texture darkens what comes from around, an environment's lamps included, and no other "
    "light") {
  test::Setting setting = core_ball(0, 1);
  setting.scene.images.push_back(
      {"half", "image/png", test::need(encode_png(Image{1, 1, 3, {0.5F, 0, 0}}, Transfer::keep))});
  Environment sunny = even_light();
  sunny.radiance[2 * 16 + 8] = V3f(100);
  REQUIRE(!split_light(sunny).lamps.empty());
  const auto middle = [&](bool has_texture, RenderPath path) {
    setting.scene.materials[0].occlusion_texture.image = has_texture ? 0 : -1;
    return in_environment(setting, sunny, path).pixels[20 * 40 + 20].y;
  };
  for (const RenderPath path : paths) {
    setting.scene.materials[0].occlusion_strength = 1;
    CHECK(middle(true, path) == doctest::Approx(128.0 / 255 * middle(false, path)).epsilon(0.01));
    setting.scene.materials[0].occlusion_strength = 0.5F;
    CHECK(middle(true, path) == doctest::Approx((1 - 0.5 * 127 / 255) * middle(false, path)).epsilon(0.01));
  }
}

TEST_CASE("a backdrop is the environment, or what a rough mirror shows of it") {
  test::Setting setting = placed_in(core_ball(1, 0), evening());
  setting.options.backdrop_roughness = 0;
  const Camera camera = test::camera_of(setting);
  const V3d away = -view_direction(camera, V2d(1.0 / 40 - 1, 1 - 1.0 / 40));
  const V3f sharp = evening().radiance_at(away);
  CHECK(test::drawn(setting, RenderPath::hybrid).pixels[0].x == doctest::Approx(sharp.x).epsilon(1e-4));
  setting.options.backdrop_roughness = 0.7F;
  const V3f blurred = reflections_of(evening()).at(away, 0.7F);
  CHECK(test::drawn(setting, RenderPath::raster).pixels[0].x == doctest::Approx(blurred.x).epsilon(1e-4));
  CHECK(std::abs(sharp.x - blurred.x) > 0.01F);
}

TEST_CASE("a wall beside cloth or metal hides half of the sky") {
  test::Setting setting;
  test::add(setting.scene, test::square(1), test::material(0));
  const M44d wall(0, 0, -200, 0, 0, 200, 0, 0, 1, 0, 0, 0, 5, 0, 0, 1);
  test::add(setting.scene, test::square(1), test::material(-1, V4f(0, 0, 0, 1)), wall);
  setting.fabrics.push_back(test::lambert_fabric(1, V3f(0.8F)));
  setting.scene.fabrics.resize(1);
  setting.camera.look_at = V3d(0, 0, 0);
  setting.camera.distance = 3;
  setting.options.width = setting.options.height = 20;
  for (const RenderPath path : paths) {
    const auto middle = [&] { return in_environment(setting, even_light(), path).pixels[10 * 20 + 10].x; };
    setting.scene.materials[0] = test::material(0);
    setting.options.shadow_map_size = 0;
    CHECK(middle() == doctest::Approx(0.8).epsilon(1e-3));
    setting.options.shadow_map_size = default_shadow_size;
    // 48 directions.
    CHECK(middle() == doctest::Approx(0.4).epsilon(0.06));
    setting.scene.materials[0] = test::material(-1);
    CHECK(middle() == doctest::Approx(0.5).epsilon(0.06));
  }
  // A wall of cloth whose mask cuts all of it.
  setting.scene.materials = {test::material(0), test::material(0)};
  GarmentTextures& kept = setting.scene.materials[1].garment_textures;
  setting.scene.images = {
      {"mask", "image/png", test::need(encode_png(Image{1, 1, 4, {1, 1, 1, 0}}, Transfer::keep))}};
  kept.mask.image = 0;
  kept.mask_cutoff = 0.5F;
  const Frame open = in_environment(setting, even_light(), RenderPath::raster);
  CHECK(open.pixels[10 * 20 + 10].x == doctest::Approx(0.8).epsilon(1e-3));
}

TEST_CASE("what a scene hides of its environment is left out where there is no memory for it") {
  test::Setting setting = placed_in(ball(product_fabric()), evening());
  test::add(setting.scene, test::square(3), test::material(-1, V4f(0, 0, 0, 1)),
            M44d().setTranslation(V3d(0, 0, -1.2)));
  const auto drawn = [&](int shadows, RenderStats& stats) {
    setting.options.shadow_map_size = shadows;
    return test::need(
        render(setting.scene, setting.fabrics, test::camera_of(setting), setting.options, &stats));
  };
  RenderStats stats;
  const Frame open = drawn(0, stats);
  CHECK(likeness(drawn(256, stats), open) < 60);
  CHECK(stats.remarks.empty());
  setting.scene.memory_left = 1000;
  CHECK(likeness(drawn(256, stats), open) > 100);
  CHECK(stats.remarks.size() == 1);
}

TEST_CASE("rough mirrors show the mean of an environment under their lobes, a small sun's included") {
  Environment e{128, 64, {}, {30, 2}};
  for (int y = 0; y < e.height; ++y) {
    for (int x = 0; x < e.width; ++x) {
      const V3d d = V3d(e.direction(x, y));
      e.radiance.push_back(d.dot(V3d(0.6, 0.64, 0.48)) > 0.995 ? V3f(300) : V3f(V3d(1 + d.y, 1, 1 - d.x)));
    }
  }
  const Reflections reflections = reflections_of(e);
  Random random(5, 0);
  for (const double roughness : {0.375, 0.5, 1.0}) {
    const double a2 = std::pow(roughness, 4);
    for (int i = 0; i < 20; ++i) {
      const V3d n = V3d(test::any_direction(random)).normalized();
      V3d sum(0, 0, 0);
      double weights = 0;
      for (int y = 0; y < e.height; ++y) {
        for (int x = 0; x < e.width; ++x) {
          const double nl = std::max(n.dot(e.direction(x, y)), 0.0);
          const double d = (1 + nl) / 2 * (a2 - 1) + 1;
          const double weight = nl / (d * d) * e.solid_angle(y);
          sum += V3d(e.radiance[y * e.width + x]) * weight;
          weights += weight;
        }
      }
      const V3d expected = sum / weights * e.options.strength;
      const V3f found = reflections.at(n, static_cast<float>(roughness));
      for (int c = 0; c < 3; ++c) CHECK(found[c] == doctest::Approx(expected[c]).epsilon(0.03));
    }
  }
}
