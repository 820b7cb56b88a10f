#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "format/scene/lights.h"
#include "format/scene/scene_points.h"
#include "tests/require.h"
#include "tests/viewer/seen_levels.h"

// Levels foreseen against those that pixels ask for, where scenes and cameras are at their edges.
namespace selvedge {
namespace {

using test::asked;
using test::see;
using test::Seen;
using test::seen_height;
using test::seen_width;

constexpr double aspect = static_cast<double>(seen_width) / seen_height;

/// A triangle with these corners and texture coordinates.
ScenePrimitive triangle(const std::array<V3f, 3>& corners, const std::array<V2d, 3>& uv) {
  ScenePrimitive p;
  p.name = "triangle/0";
  const V3f normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
  for (std::size_t i = 0; i < 3; ++i) {
    p.positions.push_back(corners[i]);
    p.normals.push_back(normal);
    p.tex_coords[0].push_back(uv[i]);
  }
  p.indices = {0, 1, 2};
  return p;
}

Camera camera_for(const CameraOptions& options) {
  return test::need(make_camera(std::vector<V3d>{V3d(-1), V3d(1)}, aspect, options));
}

/// Whether pixels ask for none but the levels foreseen; the number of pixels.
int is_foreseen(const Scene& scene, const Camera& camera, const Fabric& fabric,
                const LevelOptions& levels = best_levels, int scale = 1) {
  const LevelRange range = asked(scene, camera, levels, fabric, nullptr, scale * seen_height);
  const Seen seen = see(scene, {fabric}, camera, levels, scale);
  if (seen.pixels == 0) return 0;
  CHECK(range.first <= seen.first);
  CHECK(range.last >= seen.last);
  return seen.pixels;
}

TEST_CASE("levels are foreseen from within the cloth") {
  const Fabric fabric = test::random_fabric(64, 64, 3);
  Scene scene;
  test::add(scene, test::sphere(24, 16, V2d(9, 5)), test::material(0));
  scene.fabrics.resize(1);
  int pixels = 0;
  for (const double from_middle : {0.0, 0.5, 0.98, 0.995, 1.0, 1.001, 1.01}) {
    for (const double azimuth : {0.0, 37.0, 180.0}) {
      CameraOptions options;
      options.field_of_view = 100;
      options.azimuth = azimuth;
      options.look_at = V3d(0, 0, from_middle - 1e-3);
      options.distance = 1e-3;
      Camera camera = camera_for(options);
      camera.near = 1e-4;
      camera.far = 10;
      pixels += is_foreseen(scene, camera, fabric);
    }
  }
  CHECK(pixels > 50000);
}

TEST_CASE("levels are foreseen of one triangle, however it lies") {
  const Fabric fabric = test::random_fabric(64, 32, 3);
  int pixels = 0;
  for (const double tilt : {0.0, 1.2, 1.55, 1.57, 2.5}) {
    for (const Projection projection : {Projection::perspective, Projection::parallel}) {
      const auto x = static_cast<float>(std::cos(tilt));
      const auto z = static_cast<float>(std::sin(tilt));
      Scene scene;
      test::add(
          scene,
          triangle({V3f(-x, -1, -z), V3f(x, -1, z), V3f(0, 1, 0)}, {V2d(0, 0), V2d(7, 0.5), V2d(-2, 11)}),
          test::material(0));
      scene.fabrics.resize(1);
      CameraOptions options;
      options.projection = projection;
      options.distance = 5;
      pixels += is_foreseen(scene, camera_for(options), fabric);
    }
  }
  CHECK(pixels > 2000);
}

TEST_CASE("levels are foreseen of a triangle of a kilometre that passes under the eye and behind it") {
  const Fabric fabric = test::random_fabric(64, 64, 3);
  int pixels = 0;
  for (const double height : {1e-3, 0.05, 1.7, 300.0}) {
    for (const double elevation : {-5.0, 0.1, 3.0, 40.0}) {
      Scene scene;
      test::add(scene,
                triangle({V3f(-500, 0, 500), V3f(500, 0, 500), V3f(0, 0, -500)},
                         {V2d(0, 0), V2d(2e5, 0), V2d(1e5, 2e5)}),
                test::material(0));
      scene.fabrics.resize(1);
      CameraOptions options;
      options.elevation = elevation;
      options.field_of_view = 60;
      options.look_at = V3d(3, height, 0);
      options.distance = 1e-3;
      Camera camera = camera_for(options);
      camera.near = 0.01;
      camera.far = 2000;
      pixels += is_foreseen(scene, camera, fabric);
    }
  }
  CHECK(pixels > 20000);
}

TEST_CASE("levels are foreseen of textures that are scaled, turned and mirrored, on meshes that are, too") {
  const Fabric fabric = test::random_fabric(48, 32, 3);
  int pixels = 0;
  for (const V2d& scale : {V2d(1, 1), V2d(0.1, 3), V2d(-2, 1), V2d(1, -0.3), V2d(-4, -4)}) {
    for (const V3d& stretch : {V3d(1, 1, 1), V3d(0.2, 2, 1), V3d(-1, 0.5, 3), V3d(-1, -1, -0.1)}) {
      SceneMaterial material = test::material(0);
      material.double_sided = stretch.x > 0;
      material.fabric->transform.scale = scale;
      material.fabric->transform.rotation = 0.7 * scale.x;
      material.fabric->transform.offset = V2d(3, -1);
      Scene scene;
      M44d world;
      world.scale(stretch);
      M44d turn;
      turn.rotate(V3d(0.3, 0.5, 0));
      test::add(scene, test::sphere(16, 8, V2d(6, 3)), material, world * turn);
      scene.fabrics.resize(1);
      CameraOptions options;
      options.distance = 9;
      options.elevation = 25;
      pixels += is_foreseen(scene, camera_for(options), fabric);
    }
  }
  CHECK(pixels > 5000);
}

TEST_CASE("levels are foreseen of a frame that is drawn four times larger") {
  const Fabric fabric = test::random_fabric(128, 128, 3);
  Scene scene;
  test::add(scene, test::sphere(24, 16, V2d(9, 5)), test::material(0));
  scene.fabrics.resize(1);
  CameraOptions options;
  options.distance = 4;
  const Camera camera = camera_for(options);
  CHECK(is_foreseen(scene, camera, fabric, best_levels, 4) > 16 * 2000);
  CHECK(asked(scene, camera, best_levels, fabric, nullptr, 4 * seen_height).first ==
        std::max(asked(scene, camera, best_levels, fabric).first - 2, 0));
}

TEST_CASE("levels are foreseen of triangles, cameras and textures at random") {
  const Fabric fabric = test::random_fabric(64, 40, 3);
  Random random(23);
  const auto between = [&](double low, double high) { return low + random.uniform() * (high - low); };
  const auto power = [&](double low, double high) { return std::pow(10.0, between(low, high)); };
  int pixels = 0;
  int frames = 0;
  int left_out = 0;
  for (int i = 0; i < 300; ++i) {
    Scene scene;
    const int count = 1 + static_cast<int>(random.uniform() * 4);
    for (int k = 0; k < count; ++k) {
      const double size = power(-1, 2);
      std::array<V3f, 3> corners;
      std::array<V2d, 3> uv;
      const double repeats = power(-1, 2);
      for (std::size_t c = 0; c < 3; ++c) {
        corners[c] = V3f(V3d(between(-1, 1), between(-1, 1), between(-1, 1)) * size);
        uv[c] = V2d(between(-1, 1), between(-1, 1)) * repeats;
      }
      SceneMaterial material = test::material(0);
      material.double_sided = random.uniform() < 0.5;
      material.fabric->transform.scale = V2d(between(-2, 2), between(-2, 2));
      material.fabric->transform.rotation = between(-3, 3);
      M44d world;
      world.scale(V3d(between(-2, 2), between(-2, 2), between(-2, 2)));
      test::add(scene, triangle(corners, uv), material, world);
    }
    scene.fabrics.resize(1);
    CameraOptions options;
    options.projection = random.uniform() < 0.7 ? Projection::perspective : Projection::parallel;
    options.azimuth = between(0, 360);
    options.elevation = between(-90, 90);
    options.field_of_view = between(5, 120);
    options.distance = power(-1, 2);
    options.zoom = random.uniform() < 0.3 ? 3 : 1;
    options.focus = V2d(between(0, 1), between(0, 1));
    const auto points = test::need(world_points(scene));
    const auto camera = test::need(make_camera(points, aspect, options));
    CAPTURE(i);
    const int seen = is_foreseen(scene, camera, fabric);
    pixels += seen;
    frames += seen > 0 ? 1 : 0;
    left_out += asked(scene, camera, best_levels, fabric).first;
  }
  MESSAGE(frames << " frames, " << pixels << " pixels, " << left_out << " levels left out");
  CHECK(frames > 100);
  CHECK(left_out > 100);
}

TEST_CASE("what a one-sided material shows from behind counts for nothing") {
  const Fabric fabric = test::random_fabric(64, 64, 3);
  const std::vector<V2d> units{V2d(64, 64)};
  for (const double mirror : {1.0, -1.0}) {
    Scene scene;
    SceneMaterial material = test::material(0);
    material.double_sided = false;
    M44d world;
    world.scale(V3d(mirror, 1, 1));
    test::add(scene, test::square(20), material, world);
    scene.fabrics.resize(1);
    for (const Projection projection : {Projection::perspective, Projection::parallel}) {
      for (const double azimuth : {0.0, 80.0, 89.0, 91.0, 100.0, 180.0}) {
        CameraOptions options;
        options.projection = projection;
        options.azimuth = azimuth;
        options.look_at = V3d(0, 0, 0);
        options.distance = 4;
        const Camera camera = camera_for(options);
        const PixelCover cover = pixel_covers(scene, camera, seen_height, units)[0];
        // A square mirrored by its node still turns its front to +z: the winding is turned with it.
        CHECK(cover.fronts == (azimuth < 90));
        CHECK_FALSE(cover.backs);
        const int pixels = is_foreseen(scene, camera, fabric);
        CHECK((pixels > 0) == (azimuth < 90));
        const LevelRange range = asked(scene, camera, best_levels, fabric);
        if (azimuth > 90) CHECK(range.first == 6);
        if (azimuth == 0) CHECK(range.first < 6);
      }
    }
    // From all around some eye sees the front.
    const auto points = test::need(world_points(scene));
    const auto around = test::need(make_orbit(points, aspect, 3, 4, {}));
    CHECK(pixel_covers(scene, around, seen_height, units)[0].fronts);
    CHECK_FALSE(pixel_covers(scene, around, seen_height, units)[0].backs);
    // Both sides of one that is seen edge on, as far as can be known.
    scene.materials[0].double_sided = true;
    CameraOptions options;
    options.azimuth = 90;
    options.look_at = V3d(0, 0, 0);
    options.distance = 4;
    const PixelCover edge = pixel_covers(scene, camera_for(options), seen_height, units)[0];
    CHECK(edge.fronts);
    CHECK(edge.backs);
  }
}

TEST_CASE(
    "from a millimetre to a kilometre all around all levels are foreseen, from afar the coarsest alone") {
  Scene scene;
  test::add(scene, test::sphere(24, 16, V2d(9, 5)), test::material(0));
  scene.fabrics.resize(1);
  const Fabric fabric = test::random_fabric(64, 64, 3);
  const auto points = test::need(world_points(scene));
  const std::vector<V2d> units{V2d(64, 64)};
  const auto range_of = [&](double nearest, double farthest) {
    const auto around = test::need(make_orbit(points, aspect, nearest, farthest, {}));
    const PixelCover cover = pixel_covers(scene, around, seen_height, units)[0];
    CHECK_FALSE(std::isnan(cover.min_size));
    CHECK_FALSE(std::isnan(cover.max_size));
    return levels_asked(cover, best_levels, 7);
  };
  const LevelRange wide = range_of(0.001, 1000);
  CHECK(wide.first == 0);
  CHECK(wide.last == 6);
  CHECK(range_of(1000, 1000).first == 6);
  Random random(3);
  for (int i = 0; i < 30; ++i) {
    CameraOptions options;
    options.azimuth = 360 * random.uniform();
    options.elevation = 180 * random.uniform() - 90;
    options.distance = std::pow(10.0, 6 * random.uniform() - 3);
    const auto camera = test::need(make_camera(points, aspect, options));
    is_foreseen(scene, camera, fabric);
  }
}

}  // namespace
}  // namespace selvedge
