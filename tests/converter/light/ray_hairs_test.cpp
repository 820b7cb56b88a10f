#include <doctest/doctest.h>

#include <cmath>

#include "converter/light/yarn_brdf.h"
#include "tests/require.h"

using namespace selvedge;

namespace {

/// A square of 1 x 1 at height 0, with a straight hair along x above it at y = 0.5, which begins at `x` and
/// is 1 long: it covers 2 * radius of the cell.
CellMesh square_with_hair(float x, float radius, float passed) {
  CellMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.normals.assign(4, {0, 0, 1});
  mesh.albedo.assign(4, {0.25F, 0.5F, 0.75F});
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  for (int k = 0; k < Hairs::points_per_hair; ++k)
    mesh.hairs.points.emplace_back(x + static_cast<float>(k) / (Hairs::points_per_hair - 1), 0.5F, 1.0F);
  mesh.hairs.root_triangles = {1};
  mesh.hairs.radius = {radius};
  mesh.hairs.transparency = {passed};
  return mesh;
}

}  // namespace

TEST_CASE("rays count the cover of hairs less what these pass, singly and in packets, across the walls") {
  for (const float x : {0.0F, 0.7F, -3.3F}) {
    for (const float passed : {0.0F, 0.32F}) {
      CAPTURE(x);
      CAPTURE(passed);
      const auto scene = test::need(RayScene::create(square_with_hair(x, 0.1F, passed), "hair"));
      constexpr int side = 120;
      int singly = 0;
      int packed = 0;
      int shadows = 0;
      for (int i = 0; i < side * side; ++i) {
        const int row = i / side;
        const V3d origin((i % side + 0.5) / side, (row + 0.5) / side, 2);
        SurfacePoint point;
        REQUIRE(scene.trace(origin, {0, 0, -1}, point));
        singly += point.hair_point >= 0;
        PointPacket points;
        REQUIRE(scene.trace(std::span(&origin, 1), {0, 0, -1}, points) == 1);
        packed += points[0].hair_point >= 0;
        CHECK((points[0].hair_point >= 0) == (point.hair_point >= 0));
        SurfacePoint below{.position = V3f(V3d(origin.x, origin.y, 0))};
        shadows += scene.is_occluded(below, {0, 0, 1});
      }
      const double expected = 0.2 * (1 - static_cast<double>(passed)) * side * side;
      CHECK(singly == doctest::Approx(expected).epsilon(0.05));
      CHECK(packed == singly);
      CHECK(shadows == doctest::Approx(expected).epsilon(0.05));
    }
  }
}

TEST_CASE("a hair has its root's colour, a round normal and its own direction as the fibre's") {
  CellMesh mesh = square_with_hair(0, 0.1F, 0);
  mesh.fibre_directions.assign(4, {0, 1, 0});
  mesh.gloss.assign(4, {0.2F, 0.3F});
  const auto scene = test::need(RayScene::create(mesh, "hair"));
  SurfacePoint point;
  REQUIRE(scene.trace({0.01, 0.501, 3}, {0, 0, -1}, point));
  REQUIRE(point.hair_point >= 0);
  const YarnBrdf s = brdf_at(scene, point);
  CHECK(s.normal.length() == doctest::Approx(1));
  CHECK(std::abs(s.normal.dot(s.fibre_direction)) < 1e-6);
  CHECK(s.normal.z > 0.95);  // in the middle of the hair
  CHECK(std::abs(s.fibre_direction.x) == doctest::Approx(1).epsilon(1e-6));
  CHECK(s.albedo == V3d(0.25, 0.5, 0.75));
  CHECK(s.gloss.weight == doctest::Approx(0.2));
  CHECK(s.gloss.roughness == doctest::Approx(0.3));
  CHECK(scene.vertex_normal(point) == point.face_normal);
  // Bounds are the surface's, without hairs.
  CHECK(scene.bounds().max.z == 0);
}
