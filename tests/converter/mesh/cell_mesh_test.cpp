#include "converter/mesh/cell_mesh.h"

#include <doctest/doctest.h>

#include <limits>

#include "tests/require.h"

using namespace selvedge;

namespace {

CellMesh triangle() {
  CellMesh mesh;
  mesh.period = {2, 3};
  mesh.positions = {V3f(0, 0, -1), V3f(1, 0, 0), V3f(0, 2, 5)};
  mesh.normals.assign(3, V3f(0, 0, 1));
  mesh.albedo.assign(3, V3f(0.5F));
  mesh.triangles.emplace_back(0, 1, 2);
  return mesh;
}

Error refusal(const CellMesh& mesh) {
  const Error error = test::error_of(validate(mesh, "m"));
  CHECK(error.file == "m");
  return error;
}

}  // namespace

TEST_CASE("bounds hold all vertices") {
  const Box box = bounds_of(triangle());
  CHECK(box.min == V3f(0, 0, -1));
  CHECK(box.max == V3f(1, 2, 5));
}

TEST_CASE("accepts a triangle") { CHECK(validate(triangle(), "m")); }

TEST_CASE("refuses a mesh without triangles") {
  CellMesh mesh = triangle();
  mesh.triangles.clear();
  CHECK(refusal(mesh).code == Code::mesh_empty);
}

TEST_CASE("refuses arrays of different sizes") {
  CellMesh mesh = triangle();
  mesh.normals.pop_back();
  CHECK(refusal(mesh).code == Code::mesh_invalid);
  mesh = triangle();
  mesh.albedo.emplace_back(0.0F);
  CHECK(refusal(mesh).code == Code::mesh_invalid);
}

TEST_CASE("refuses indices out of range, with the triangle") {
  for (const int bad : {-1, 3}) {
    CellMesh mesh = triangle();
    mesh.triangles.emplace_back(0, 1, bad);
    CHECK(refusal(mesh).code == Code::mesh_invalid);
    CHECK(refusal(mesh).place == "triangle 1");
  }
}

TEST_CASE("refuses vertices that are not finite, with the vertex") {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    CellMesh mesh = triangle();
    mesh.positions[1].y = bad;
    CHECK(refusal(mesh).code == Code::mesh_not_finite);
    CHECK(refusal(mesh).place == "vertex 1");
    mesh = triangle();
    mesh.normals[2].x = bad;
    CHECK(refusal(mesh).place == "vertex 2");
    mesh = triangle();
    mesh.albedo[0].x = bad;
    CHECK(refusal(mesh).place == "vertex 0");
  }
}

TEST_CASE("refuses periods that are not positive") {
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    CellMesh mesh = triangle();
    mesh.period.x = bad;
    CHECK(refusal(mesh).code == Code::mesh_invalid);
    CHECK(refusal(mesh).place == "period x");
  }
}
