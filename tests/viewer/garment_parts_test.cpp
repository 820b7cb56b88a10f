// Textures of a garment beside its fabric, against closed forms, and the two paths against each other.
#include <doctest/doctest.h>

#include <functional>
#include <numbers>

#include "format/picture/environment.h"
#include "format/picture/image.h"
#include "format/scene/camera.h"
#include "tests/viewer/paths.h"

using namespace selvedge;

namespace {

constexpr std::array paths{RenderPath::hybrid, RenderPath::raster};
constexpr double pi = std::numbers::pi;

/// A picture of bytes.
SceneImage picture(int side, const std::function<std::array<int, 4>(int x, int y)>& texel) {
  Image image{side, side, 4, {}};
  for (int i = 0; i < side * side; ++i)
    for (const int byte : texel(i % side, i / side)) image.pixels.push_back(static_cast<float>(byte) / 255);
  return {"picture", "image/png", test::need(encode_png(image, Transfer::keep))};
}
SceneImage plain_picture(const std::array<int, 4>& bytes) {
  return picture(4, [&](int, int) { return bytes; });
}

test::Setting curtain(Fabric fabric, const std::vector<SceneImage>& images, bool from_behind = false) {
  test::Setting setting;
  test::add(setting.scene, test::square(1), test::material(0));
  setting.scene.images = images;
  setting.scene.fabrics.resize(1);
  setting.fabrics.push_back(std::move(fabric));
  setting.camera.azimuth = from_behind ? 160 : 20;
  setting.options.width = setting.options.height = 96;
  setting.options.lights = {{V3d(0.3, 0.2, from_behind ? -0.6 : 0.6).normalized(), V3f(2)}};
  return setting;
}

V4f middle_of(const test::Setting& setting, RenderPath path) {
  const Frame frame = test::drawn(setting, path);
  return frame.pixels[frame.width * frame.height / 2 + frame.width / 2];
}

}  // namespace

TEST_CASE("a mask that grows along u cuts a square along a straight line, from in front and from behind") {
  // Between the centres of its texels, (i + 0.5) / 51 of the side, the mask is linear: u - 0.5 / 51.
  const SceneImage ramp = picture(51, [](int x, int) { return std::array{9, 200, 9, 5 * x}; });
  for (const RenderPath path : paths) {
    for (const bool behind : {false, true}) {
      test::Setting setting = curtain(test::lambert_fabric(2, V3f(0.5F)), {ramp}, behind);
      const Frame whole = test::drawn(setting, path);
      GarmentTextures& kept = setting.scene.materials[0].garment_textures;
      kept.mask.image = 0;
      kept.mask.wrap_u = kept.mask.wrap_v = Wrap::clamp;
      kept.mask_cutoff = 0.25F;
      const Frame cut = test::drawn(setting, path);
      const Camera camera = test::camera_of(setting);
      const ViewDirections rays = view_directions(camera, cut.width, cut.height);
      int kept_pixels = 0;
      int gone = 0;
      for (int i = 0; i < cut.width * cut.height; ++i) {
        if (!(whole.pixels[i].w > 0)) continue;
        const V2f at(static_cast<float>(i % cut.width) - 0.5F * static_cast<float>(cut.width - 1),
                     0.5F * static_cast<float>(cut.height - 1) - static_cast<float>(i / cut.width));
        // From the eye to the viewed point is against the ray, which points towards the viewer.
        const V3d ray = V3d(rays.centre_direction + rays.step_right * at.x + rays.step_up * at.y);
        const V3d point = camera.position - ray * (camera.position.z / ray.z);
        const double past = (point.x + 1) / 2 - 0.5 / 51 - 0.25;
        if (std::abs(past) < 1e-4) continue;
        CHECK(cut.pixels[i] == (past > 0 ? whole.pixels[i] : V4f(0, 0, 0, 0)));
        ++(past > 0 ? kept_pixels : gone);
      }
      CHECK(kept_pixels > 1000);
      CHECK(gone > 300);
    }
  }
}

TEST_CASE("a normal texture of one tilt shows the fabric as a square with that normal does") {
  const std::array bytes{204, 90, 220, 255};
  V3d tilt;
  for (int c = 0; c < 3; ++c) tilt[c] = bytes[c] / 255.0 * 2 - 1;
  const auto transformed = [](double rotation, const V2d& scale) {
    UvTransform transform;
    transform.rotation = rotation;
    transform.scale = scale;
    return transform;
  };
  for (const UvTransform& of_normal : {transformed(0, {1, 1}), transformed(pi / 2, {3, 2}),
                                       transformed(0.5, {2, 2}), transformed(0, {-2, 1})}) {
    for (const bool behind : {false, true}) {
      test::Setting setting = curtain(test::lambert_fabric(4, V3f(0.7F, 0.5F, 0.3F)), {plain_picture(bytes)},
                                      behind);  // images know how bright a bend is
      setting.scene.materials[0].fabric->transform = transformed(0.3, {2, 3});
      setting.scene.materials[0].garment_textures.normal.image = 0;
      setting.scene.materials[0].garment_textures.normal.transform = of_normal;
      // On the square u grows along x, and v along -y, at the same rate. A direction of the picture, dP/du'
      // or against dP/dv', is that by which u' or v' alone changes.
      const V2d row_u(of_normal.apply_linear({1, 0}).x, of_normal.apply_linear({0, 1}).x);
      const V2d row_v(of_normal.apply_linear({1, 0}).y, of_normal.apply_linear({0, 1}).y);
      const double turn = row_u.x * row_v.y - row_u.y * row_v.x;
      const V3d along = V3d(row_v.y, row_v.x, 0).normalized() * (turn > 0 ? 1 : -1);
      const V3d across = V3d(row_u.y, row_u.x, 0).normalized() * (turn > 0 ? 1 : -1);
      // Perpendicular to each other, as the frame of the fabric is, u' going first.
      const V3d up = V3d(-along.y, along.x, 0) * (along.cross(across).z > 0 ? 1 : -1);
      const V3d normal = along * tilt.x + up * tilt.y + V3d(0, 0, tilt.z);
      test::Setting tilted = setting;
      tilted.scene.materials[0].garment_textures = {};
      for (V3f& n : tilted.scene.primitives[0].normals) n = V3f(normal.normalized());
      for (const RenderPath path : paths) {
        const Frame a = test::drawn(setting, path);
        const Frame b = test::drawn(tilted, path);
        float brightest = 0;
        float apart = 0;
        for (std::size_t i = 0; i < a.pixels.size(); ++i) {
          brightest = std::max(brightest, b.pixels[i].x);
          for (int c = 0; c < 4; ++c) apart = std::max(apart, std::abs(a.pixels[i][c] - b.pixels[i][c]));
        }
        CHECK(brightest > 0.02F);
        // OSMesa reads a picture to 1e-3.
        CHECK(apart < 8 * 1e-3F * brightest);
      }
    }
  }
}

TEST_CASE("a tint is a factor on the albedo of matt cloth") {
  const V3f albedo(0.5F, 0.4F, 0.3F);
  const V3f factor(0.5F, 1, 1.25F);
  const std::array bytes{188, 255, 64, 255};
  test::Setting setting = curtain(test::lambert_fabric(2, albedo), {plain_picture(bytes)});
  GarmentTextures& kept = setting.scene.materials[0].garment_textures;
  for (const bool textured : {false, true}) {
    kept.tint = factor;
    if (textured) kept.tint_texture.image = 0;
    V3f tinted = albedo * factor;
    for (int c = 0; c < 3 && textured; ++c) tinted[c] *= srgb_to_linear(static_cast<float>(bytes[c]) / 255);
    if (textured) {  // and vertex colours, whose alpha is not read
      ScenePrimitive& p = setting.scene.primitives[0];
      p.colors.assign(p.positions.size(), V4f(0.5F, 1, 0.75F, 0.1F));
      tinted *= V3f(0.5F, 1, 0.75F);
    }
    const test::Setting plain = curtain(test::lambert_fabric(2, tinted), {});
    for (const RenderPath path : paths) {
      const V4f seen = middle_of(setting, path);
      const V4f wanted = middle_of(plain, path);
      CHECK(wanted.y > 0.05F);
      for (int c = 0; c < 4; ++c)
        CHECK(seen[c] == doctest::Approx(wanted[c]).epsilon(textured ? 1e-3 : 5e-4));
    }
  }
}

TEST_CASE("an occlusion texture dims what comes from all around, and no lamp") {
  test::Setting setting = curtain(test::lambert_fabric(2, V3f(0.5F)), {plain_picture({51, 0, 0, 255})});
  SceneMaterial& material = setting.scene.materials[0];
  material.occlusion_texture.image = 0;
  material.occlusion_strength = 0.5F;
  for (const RenderPath path : paths) {
    test::Setting bare = setting;
    bare.scene.materials[0].occlusion_strength = 0;
    CHECK((middle_of(setting, path) - middle_of(bare, path)).length() < 1e-6F);
    const Environment even{16, 8, std::vector<V3f>(128, V3f(1, 1, 1)), {}};
    test::Setting around = setting;
    around.options.lights = split_light(even).lamps;
    around.options.smooth_light = split_light(even).smooth_light;
    // 1 + strength (texture - 1) of the albedo.
    CHECK(middle_of(around, path).x == doctest::Approx(0.5 * (1 + 0.5 * (0.2 - 1))).epsilon(1e-3));
  }
}

TEST_CASE("the shadow of a masked square ends where its mask does") {
  // A lamp from the left casts the shadow of the square's left half on a wall behind it.
  const SceneImage left_half = picture(64, [](int x, int) { return std::array{0, 0, 0, x < 32 ? 255 : 0}; });
  test::Setting setting;
  SceneMaterial material = test::material(0);
  test::add(setting.scene, test::square(1), material);
  test::add(setting.scene, test::square(4, -1), test::material(1));
  for (V3f& p : setting.scene.primitives[1].positions) p = V3f(4 * p.x, 4 * p.y, p.z);
  setting.scene.images = {left_half};
  setting.scene.fabrics.resize(2);
  setting.fabrics = {test::lambert_fabric(2, V3f(0.5F)), test::lambert_fabric(2, V3f(0.5F))};
  setting.options.width = setting.options.height = 128;
  setting.options.lights = {{V3d(-1, 0, 1).normalized(), V3f(2)}};
  setting.options.shadow_map_size = 512;
  // Shadows of x are at x + 1 on the wall.
  const auto wall_at = [&](const Frame& frame, const Camera& camera, double x) {
    V3d place;
    clip_matrix(camera, V3d(0)).multVecMatrix(V3d(x, 0, -1), place);
    const int column = static_cast<int>((place.x + 1) / 2 * frame.width);
    return frame.pixels[frame.height / 2 * frame.width + column].x;
  };
  for (const RenderPath path : paths) {
    const Camera camera = test::camera_of(setting);
    setting.scene.materials[0].garment_textures.mask.image = -1;
    const Frame whole = test::drawn(setting, path);
    setting.scene.materials[0].garment_textures.mask.image = 0;
    const Frame cut = test::drawn(setting, path);
    CHECK(wall_at(whole, camera, 1.6) == 0);
    CHECK(wall_at(cut, camera, 1.6) > 0.1F);
    CHECK(wall_at(cut, camera, 0.6) == 0);
    CHECK(wall_at(cut, camera, 2.4) == wall_at(whole, camera, 2.4));
  }
}
