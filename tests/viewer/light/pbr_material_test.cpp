// Materials without a fabric: the formula of glTF's appendix B against its own text and closed forms,
// pictures against that.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "format/picture/image.h"
#include "tests/require.h"
#include "tests/viewer/paths.h"
#include "viewer/light/pbr_brdf.h"
#include "viewer/light/reflections.h"

namespace selvedge {
namespace {

constexpr double pi = std::numbers::pi;

/// The specification's formulas as they are written there (glTF 2.0, B.2 and B.3), times N.L, one channel.
double by_the_book(double base, double metallic, double roughness, const V3d& n, const V3d& v, const V3d& l) {
  const auto step = [](double x) { return x > 0 ? 1.0 : 0.0; };
  const double alpha = roughness * roughness;
  const double a2 = alpha * alpha;
  const V3d h = (l + v).normalized();
  const double nh = n.dot(h);
  const double nl = n.dot(l);
  const double nv = n.dot(v);
  if (!(nl > 0)) return 0;
  const double d = a2 * step(nh) / (pi * std::pow(nh * nh * (a2 - 1) + 1, 2));
  const auto side = [&](double nx, double hx) {
    return 2 * std::abs(nx) * step(hx) / (std::abs(nx) + std::sqrt(a2 + (1 - a2) * nx * nx));
  };
  const double g = side(nl, h.dot(l)) * side(nv, h.dot(v));
  const double c_diff = std::lerp(base, 0.0, metallic);
  const double f0 = std::lerp(0.04, base, metallic);
  const double schlick = std::pow(1 - std::abs(v.dot(h)), 5);
  const double f = f0 + (1 - f0) * schlick;
  // The mix of a dielectric and a metal (B.2), not its short form (B.3.5), where the metal darkens the base.
  return ((1 - 0.04) * (1 - schlick) * c_diff / pi + f * d * g / (4 * std::abs(nv) * std::abs(nl))) * nl;
}

double red_of(double base, double metallic, double roughness, const V3d& n, const V3d& v, const V3d& l) {
  const PbrPoint m{V3f(static_cast<float>(base)), static_cast<float>(metallic),
                   static_cast<float>(roughness)};
  return static_cast<double>(pbr_brdf(m, V3f(n), V3f(v), V3f(l)).x);
}

V3d from_angles(double theta, double phi) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

/// Radiance in a white furnace, by the midpoint rule.
double furnace(double base, double metallic, double roughness, double view_angle) {
  constexpr int rings = 400;
  constexpr int spokes = 400;
  const V3d v = from_angles(view_angle, 0);
  double sum = 0;
  for (int i = 0; i < rings; ++i) {
    const double theta = (i + 0.5) / rings * pi / 2;
    for (int j = 0; j < spokes; ++j) {
      const V3d l = from_angles(theta, (j + 0.5) / spokes * 2 * pi);
      sum += red_of(base, metallic, roughness, V3d(0, 0, 1), v, l) * std::sin(theta);
    }
  }
  return sum * (pi / 2 / rings) * (2 * pi / spokes);
}

}  // namespace

TEST_CASE("a mirror's peak, the dark side and Lambert's limit have their closed forms") {
  const V3d up(0, 0, 1);
  // D is 1 / (pi alpha^2) at its peak, the visibility 1/4.
  for (const double roughness : {1.0, 0.5, 0.2, 0.1})
    CHECK(red_of(0.8, 1, roughness, up, up, up) ==
          doctest::Approx(0.8 / (4 * pi * std::pow(roughness, 4))).epsilon(1e-4));
  // Light reflected at the surface of a dielectric does not reach its base.
  CHECK(red_of(0.5, 0, 1, up, up, up) == doctest::Approx(0.96 * 0.5 / pi + 0.04 / (4 * pi)).epsilon(1e-5));
  CHECK(red_of(0.5, 0, 0.5, up, up, V3d(0.6, 0, -0.8)) == 0);
  // Without a surface there is Lambert: far from the mirror's direction little else is left.
  const V3d low = V3d(1, 0, 0.3).normalized();
  const double h = (up + low).normalized().dot(up);
  const double f = 0.04 + 0.96 * std::pow(1 - h, 5);
  CHECK(red_of(0.5, 0, 0.1, up, up, low) == doctest::Approx((1 - f) * 0.5 / pi * low.z).epsilon(1e-3));
}

TEST_CASE("a metal never gives more light than it gets, a smooth one gives all of it back") {
  for (const double angle : {0.0, 0.7, 1.2, 1.5}) {
    for (const double roughness : {0.3, 0.6, 1.0}) {
      CAPTURE(angle);
      CAPTURE(roughness);
      CHECK(furnace(1, 1, roughness, angle) <= 1.0005);
    }
  }
  CHECK(furnace(1, 1, 0.3, 0) == doctest::Approx(1).epsilon(0.01));
  // The two layers of a dielectric add up to less than 1 where it is looked at from above.
  for (const double roughness : {0.3, 0.6, 1.0}) CHECK(furnace(1, 0, roughness, 0.5) <= 1.0005);
}

TEST_CASE("the fractions of even light are those that the formula gathers") {
  for (const double angle : {0.0, 0.5, 1.0, 1.4}) {
    for (const double roughness : {0.3, 0.6, 1.0}) {
      CAPTURE(angle);
      CAPTURE(roughness);
      const V2f fraction =
          environment_brdf(static_cast<float>(roughness), static_cast<float>(std::cos(angle)));
      for (const double f0 : {0.2, 1.0})
        CHECK(f0 * static_cast<double>(fraction.x) + static_cast<double>(fraction.y) ==
              doctest::Approx(furnace(f0, 1, roughness, angle)).epsilon(0.01));
    }
  }
}

TEST_CASE("a sphere in a core material shows the specification's formula on either path") {
  for (const double metallic : {0.0, 1.0}) {
    test::Setting setting;
    SceneMaterial material = test::material(-1, V4f(0.8F, 0.5F, 0.2F, 1));
    material.metallic = static_cast<float>(metallic);
    material.roughness = 0.6F;
    test::add(setting.scene, test::sphere(256, 128, V2d(1, 1)), material);
    setting.options.width = 120;
    setting.options.height = 100;
    setting.options.mirrored_ambient_irradiance = 0;
    const Light light{V3d(0.48, 0.6, 0.64), V3f(3, 2, 1)};
    setting.options.lights = {light};
    const Camera camera = test::camera_of(setting);
    for (const RenderPath path : {RenderPath::hybrid, RenderPath::raster}) {
      const Frame frame = test::drawn(setting, path);
      double worst = 0;
      int compared = 0;
      for (int y = 0; y < frame.height; ++y) {
        for (int x = 0; x < frame.width; ++x) {
          const V3d view =
              view_direction(camera, V2d((2.0 * x + 1) / frame.width - 1, 1 - (2.0 * y + 1) / frame.height));
          const double along = camera.position.dot(view);
          const double under_root = along * along - camera.position.length2() + 1;
          // The silhouette is a polygon's.
          if (under_root < 0.01) continue;
          const V3d normal = camera.position - view * (along - std::sqrt(under_root));
          const V4f& pixel = frame.pixels[y * frame.width + x];
          for (int c = 0; c < 3; ++c) {
            const double base = std::array{0.8, 0.5, 0.2}[c];
            const double expected =
                by_the_book(base, metallic, 0.6, normal, view, light.direction) * light.irradiance[c];
            worst = std::max(worst, std::abs(expected - static_cast<double>(pixel[c])));
          }
          ++compared;
        }
      }
      CHECK(compared > 2000);
      // Highlights reach 1; roughness has 16 bits, normals are off by 1e-4.
      CHECK(worst < 3e-3);
    }
  }
}

TEST_CASE("a fabric's material gives its own light on top of the fabric's") {
  test::Setting setting;
  SceneMaterial plain = test::material(0);
  test::add(setting.scene, test::square(1), plain);
  setting.fabrics = {test::lambert_fabric(4, V3f(0.5F), 0.5F)};
  setting.options.width = setting.options.height = 32;
  setting.options.lights = {{V3d(0, 0, 1), V3f(1)}};
  for (const RenderPath path : {RenderPath::hybrid, RenderPath::raster}) {
    setting.scene.materials[0].emissive = V3f(0);
    const V4f dark = test::drawn(setting, path).pixels[16 * 32 + 16];
    setting.scene.materials[0].emissive = V3f(0.25F, 0.5F, 2);
    const V4f bright = test::drawn(setting, path).pixels[16 * 32 + 16];
    CHECK(bright.w == dark.w);
    // Through its holes one does not see it shine.
    for (int c = 0; c < 3; ++c)
      CHECK(bright[c] - dark[c] ==
            doctest::Approx(0.5 * setting.scene.materials[0].emissive[c]).epsilon(1e-3));
  }
}

TEST_CASE("normals turn with their texture, on the back the other way, and unlit surfaces know no light") {
  test::Setting setting;
  SceneMaterial material = test::material(-1);
  material.metallic = 0;
  material.normal_texture.image = 0;
  // (0.6, 0, 0.8) in the texture's axes: to the right, which is +x on the square.
  Image image{1, 1, 3, {0.8F, 0.5F, 0.9F}};
  const auto png = test::need(encode_png(image, Transfer::keep));
  setting.scene.images.push_back({"normal", "image/png", png});
  test::add(setting.scene, test::square(1), material);
  setting.options.width = setting.options.height = 32;
  setting.options.mirrored_ambient_irradiance = 0;
  setting.camera.projection = Projection::parallel;
  const V3d normal = V3d(2 * 204 / 255.0 - 1, 2 * 128 / 255.0 - 1, 2 * 230 / 255.0 - 1).normalized();
  for (const RenderPath path : {RenderPath::hybrid, RenderPath::raster}) {
    for (const bool back : {false, true}) {
      setting.camera.azimuth = back ? 180 : 0;
      setting.scene.materials[0].unlit = false;
      const V3d view(0, 0, back ? -1 : 1);
      for (const V3d& light : {V3d(0.6, 0, 0.8), V3d(-0.6, 0, 0.8)}) {
        const V3d l = back ? -light : light;
        setting.options.lights = {{l, V3f(1)}};
        const V4f pixel = test::drawn(setting, path).pixels[16 * 32 + 16];
        CHECK(pixel.x ==
              doctest::Approx(by_the_book(1, 0, 1, back ? -normal : normal, view, l)).epsilon(2e-3));
      }
      setting.scene.materials[0].unlit = true;
      CHECK(test::drawn(setting, path).pixels[16 * 32 + 16].y == doctest::Approx(1 / pi));
    }
  }
}

}  // namespace selvedge
