#include "samples/assembly.h"

#include <doctest/doctest.h>

#include "tests/samples/garment_checks.h"

namespace selvedge::samples {
namespace {

/// A square of two triangles in two patches, joined along its diagonal.
Assembly square() {
  Assembly assembly;
  assembly.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  Patch lower{"sweater", {0, 1, 2}, {{0, 1}, {1, 1}, {1, 0}}, {V3i(0, 1, 2)}};
  Patch upper{"trim", {0, 2, 3}, {{0, 1}, {1, 0}, {0, 0}}, {V3i(0, 1, 2)}};
  assembly.patches = {lower, upper};
  return assembly;
}

TEST_CASE("patches that share points make one surface") {
  Assembly assembly = square();
  CHECK(count_boundary_loops(assembly) == 1);
  assembly.points.push_back(assembly.points[0]);
  assembly.points.push_back(assembly.points[2]);
  assembly.patches[1].points = {4, 5, 3};
  CHECK(count_boundary_loops(assembly) == 2);
}

TEST_CASE("normals are weighted by area over the patches") {
  Assembly assembly = square();
  for (const V3d& normal : normals_of(assembly)) CHECK(normal == V3d(0, 0, 1));
  // The upper triangle stands upright now and has sqrt(2) x 3 of area to sqrt(2) / sqrt(2) below.
  assembly.points[3] = V3d(0.5, 0.5, 3);
  const V3d normal = normals_of(assembly)[0];
  const V3d expected = (V3d(0, 0, 1) + V3d(3, -3, 0)).normalized();
  CHECK((normal - expected).length() < 1e-12);
}

TEST_CASE("materials become primitives in the order of the patches") {
  const Garment garment = garment_of(square(), "patchwork");
  CHECK(garment.name == "patchwork");
  REQUIRE(garment.primitives.size() == 2);
  CHECK(garment.materials[1].name == "trim");
  CHECK(garment.primitives[1].material == 1);
  CHECK(garment.primitives[0].indices == std::vector<std::uint32_t>{0, 1, 2});
  CHECK(garment.materials[0].double_sided);
}

}  // namespace
}  // namespace selvedge::samples
