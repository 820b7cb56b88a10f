#include "samples/sweater.h"

#include <doctest/doctest.h>

#include <cmath>

#include "samples/sweater_cage.h"
#include "tests/samples/garment_checks.h"

namespace selvedge::samples {
namespace {

/// From the middle of the body or of the sleeve towards a point of the cloth.
V3d from_axis(const V3d& p, bool sleeve) {
  if (!sleeve) return {p.x, 0, p.z};
  const int side = p.x < 0 ? -1 : 1;
  const V3d joint = sleeve_centre(0, side);
  return p - sleeve_centre((p - joint).dot(sleeve_direction(side)), side);
}

void check_surface(const Assembly& sweater) {
  CHECK(count_boundary_loops(sweater) == 4);  // hem, neck and two cuffs

  V3d low = sweater.points.front();
  V3d high = low;
  std::size_t triangles = 0;
  for (const V3d& p : sweater.points) {
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
  for (const Patch& patch : sweater.patches) triangles += patch.triangles.size();
  CHECK(low.y == 0);
  CHECK(high.y == doctest::Approx(0.65).epsilon(0.03));
  CHECK(high.x - low.x == doctest::Approx(1.0).epsilon(0.05));  // cuff to cuff
  CHECK(high.z - low.z < 0.35);
  CHECK(std::abs(high.x + low.x) < 0.01);
  CHECK(triangles > 20000);
  CHECK(triangles < 62000);

  // Outwards: but for folds that hang over the hem or lie in the armpit.
  const std::vector<V3d> normals = normals_of(sweater);
  std::size_t outwards = 0;
  std::size_t counted = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Patch& patch = sweater.patches[i];
    REQUIRE(patch.material == "sweater");
    for (const int point : patch.points) {
      const V3d& normal = normals[point];
      CHECK(normal.length() == doctest::Approx(1));
      // The body is shifted by its hem, which the sleeves' line does not know of.
      const V3d p = sweater.points[point] - V3d(0, 0.035, 0);
      outwards += normal.dot(from_axis(p, i >= 2)) > 0 ? 1 : 0;
      ++counted;
    }
  }
  CHECK(static_cast<double>(outwards) > 0.97 * static_cast<double>(counted));
}

void check_stitches(const Assembly& sweater) {
  const Measured body = measure(sweater, "sweater");
  const Measured trim = measure(sweater, "trim");
  MESSAGE("within 10 %: body " << 100 * body.kept / body.area << " %, trim " << 100 * trim.kept / trim.area
                               << " %; largest " << body.largest << " and " << trim.largest);
  CHECK(body.mirrored == 0);
  CHECK(trim.mirrored == 0);
  CHECK(body.kept > 0.99 * body.area);
  CHECK(trim.kept > 0.80 * trim.area);  // the turned edges are what is left
  CHECK(body.kept + trim.kept > 0.95 * (body.area + trim.area));
}

void check_wales(const Assembly& sweater) {
  for (std::size_t i = 0; i < 4; ++i) {
    const Patch& patch = sweater.patches[i];
    double area = 0;
    double straight = 0;
    for (const V3i& t : patch.triangles) {
      const std::size_t a = static_cast<std::size_t>(t[0]);
      const std::size_t b = static_cast<std::size_t>(t[1]);
      const std::size_t c = static_cast<std::size_t>(t[2]);
      const auto point = [&](std::size_t v) { return sweater.points[patch.points[v]]; };
      const V3d p = point(b) - point(a);
      const V3d q = point(c) - point(a);
      const V2d d = patch.tex_coords[b] - patch.tex_coords[a];
      const V2d e = patch.tex_coords[c] - patch.tex_coords[a];
      const V3d wale = ((q * d.x - p * e.x) / (d % e)).normalized();
      const int side = point(a).x < 0 ? -1 : 1;
      const V3d normal = p.cross(q).normalized();
      V3d down = i < 2 ? V3d(0, -1, 0) : sleeve_direction(side);
      down -= normal * normal.dot(down);  // as far as the cloth goes that way
      const double size = p.cross(q).length();
      area += size;
      straight += wale.dot(down.normalized()) * size;
    }
    // The mean over the shoulders, where the cloth lies nearly level, and all folds: cos 15 degrees.
    MESSAGE("panel " << i << ": mean cosine " << straight / area);
    CHECK(straight / area > 0.966);
  }
}

// In one test: to drape a sweater is what takes long.
TEST_CASE(
    "the sweater is one surface with four openings, of the size of a sweater, its stitches keep theirs, and "
    "its "
    "wales run down the body and along the sleeves") {
  const Assembly sweater = make_sweater();
  check_surface(sweater);
  check_stitches(sweater);
  check_wales(sweater);
}

TEST_CASE("vertices on a seam have the same position and normal, bit by bit") {
  const Assembly sweater = make_sweater({.levels = 1, .drape_steps = 20});
  const Garment garment = garment_of(sweater, "sweater");
  REQUIRE(garment.primitives.size() == 2);
  CHECK(garment.materials[0].name == "sweater");
  CHECK(garment.materials[1].name == "trim");
  for (std::size_t m = 0; m < 2; ++m) {
    const GarmentPrimitive& primitive = garment.primitives[m];
    std::size_t vertex = 0;
    for (const Patch& patch : sweater.patches) {
      if (patch.material != garment.materials[m].name) continue;
      for (const int point : patch.points) {
        CHECK(primitive.positions[vertex] == V3f(sweater.points[point]));
        CHECK(primitive.normals[vertex].length() == doctest::Approx(1));
        ++vertex;
      }
    }
    CHECK(vertex == primitive.positions.size());
  }
}

TEST_CASE("the sweater is the same each time") {
  const SweaterOptions quick{.levels = 2, .drape_steps = 50};
  const Assembly first = make_sweater(quick);
  const Assembly second = make_sweater(quick);
  CHECK(same(first, second));
}

}  // namespace
}  // namespace selvedge::samples
