#include "converter/mesh/cell_mesh.h"

#include <doctest/doctest.h>

#include <functional>
#include <limits>
#include <vector>

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

}  // namespace

TEST_CASE("bounds hold all vertices") {
  const Imath::Box3f box = bounds_of(triangle());
  CHECK(box.min == V3f(0, 0, -1));
  CHECK(box.max == V3f(1, 2, 5));
}

TEST_CASE("a triangle is a valid mesh, and each broken rule is refused where it is broken") {
  CHECK(validate(triangle(), "m"));
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  constexpr float infinite = std::numeric_limits<float>::infinity();
  struct Case {
    Code code;
    const char* place;
    std::function<void(CellMesh&)> change;
  };
  for (const auto& [code, place, change] : std::vector<Case>{
           {Code::mesh_empty, "", [](CellMesh& m) { m.triangles.clear(); }},
           {Code::mesh_not_finite, "vertex 1", [](CellMesh& m) { m.positions[1].y = nan; }},
           {Code::mesh_not_finite, "vertex 1", [](CellMesh& m) { m.positions[1].y = infinite; }},
           {Code::mesh_invalid, "period x", [](CellMesh& m) { m.period.x = 0; }},
           {Code::mesh_invalid, "period y", [](CellMesh& m) { m.period.y = double{nan}; }}}) {
    CellMesh mesh = triangle();
    change(mesh);
    const Error error = test::error_of(validate(mesh, "m"));
    CHECK(error.file == "m");
    CHECK(error.code == code);
    CHECK(error.place == place);
  }
}
