#include "samples/tablecloth.h"

#include <doctest/doctest.h>

#include <cmath>

#include "tests/samples/garment_checks.h"

namespace selvedge::samples {
namespace {

/// As long everywhere as it is flat.
void check_length(const Assembly& table, const TableclothOptions& options) {
  const Measured cloth = measure(table, "tablecloth");
  MESSAGE("within 10 %: " << 100 * cloth.kept / cloth.area << " %; largest " << cloth.largest);
  CHECK(cloth.mirrored == 0);
  CHECK(cloth.kept > 0.98 * cloth.area);
  const double radius = options.table_radius + options.overhang;
  CHECK(cloth.area == doctest::Approx(3.14159265 * radius * radius).epsilon(0.01));
}

/// Flat on the table, hanging beside it.
void check_place(const Assembly& table, const TableclothOptions& options) {
  const Patch& cloth = table.patches[0];
  double lowest = options.table_height;
  for (std::size_t v = 0; v < cloth.points.size(); ++v) {
    const V3d& p = table.points[cloth.points[v]];
    const double s = cloth.tex_coords[v].length();
    const double r = std::hypot(p.x, p.z);
    lowest = std::min(lowest, p.y);
    if (s < 0.9 * options.table_radius) CHECK(p.y == doctest::Approx(options.table_height).epsilon(0.01));
    if (p.y < options.table_height - 0.012) CHECK(r > options.table_radius);
  }
  CHECK(lowest < options.table_height - 0.75 * options.overhang);
  CHECK(lowest > options.table_height - 1.01 * options.overhang);  // it gives a little under its weight
}

// In one test: to drape a tablecloth is what takes long.
TEST_CASE("the tablecloth is as long everywhere as it is flat, lies flat on the table and hangs beside it") {
  const TableclothOptions options;
  const Assembly table = make_tablecloth(options);
  check_length(table, options);
  check_place(table, options);
}

TEST_CASE("the cloth has one edge and the table none") {
  const Assembly table = make_tablecloth({.rings = 20, .drape_steps = 10});
  CHECK(count_boundary_loops(table) == 1);
  REQUIRE(table.patches.size() == 2);
  CHECK(table.patches[1].material == "wood");
  for (const V3d& normal : normals_of(table)) CHECK(normal.length() == doctest::Approx(1));
}

TEST_CASE("the tablecloth is the same each time") {
  const TableclothOptions quick{.rings = 30, .drape_steps = 50};
  CHECK(same(make_tablecloth(quick), make_tablecloth(quick)));
}

}  // namespace
}  // namespace selvedge::samples
