#include "converter/stitch/implicit_surface.h"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "converter/stitch/library.h"
#include "converter/stitch/marching_cubes.h"
#include "format/base/random.h"
#include "tests/converter/cells.h"
#include "tests/converter/load_cell.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::testing;

namespace {

ImplicitSurface surface_of(const StitchPattern& pattern, double reach = 0.5) {
  return test::need(ImplicitSurface::build(pattern, reach, pattern.name));
}

CellMesh as_mesh(const MarchedSurface& surface, const V2d& period) {
  CellMesh mesh;
  mesh.period = period;
  for (const V3d& p : surface.positions) mesh.positions.emplace_back(p);
  mesh.triangles = surface.triangles;
  return mesh;
}

}  // namespace

TEST_CASE("the distance to a ring is the torus's") {
  const ImplicitSurface surface = surface_of(ring(4, 1.2, 0.5));
  Random random(2);
  for (int i = 0; i < 2000; ++i) {
    const V3d p(4 * random.uniform(), 4 * random.uniform(), 2 * random.uniform() - 1);
    const double from_axis = std::hypot(p.x - 2, p.y - 2);
    double expected = std::hypot(from_axis - 1.2, p.z) - 0.5;
    // Copies' rings are 4 apart: nearer than this one's only beyond the reach of 0.5.
    expected = std::min(expected, 0.5);
    CHECK(std::abs(surface.distance(p) - expected) < 5e-9);  // the arcs are off a circle by 1e-9 of 1.2
  }
}

TEST_CASE("the distance to a bent yarn is the least over densely sampled copies") {
  const StitchPattern pattern = plain_knit();
  const ImplicitSurface surface = surface_of(pattern, 0.4);
  std::vector<V3d> skeleton;
  for (int sy = -3; sy <= 3; ++sy) {
    for (int sx = -2; sx <= 2; ++sx)
      for (const BezierSegment& segment : pattern.yarns[0].segments)
        for (int k = 0; k < 200; ++k)
          skeleton.push_back(point_at(segment, k / 200.0) +
                             V3d(sx * pattern.period_mm.x, sy * pattern.period_mm.y, 0));
  }
  Random random(3);
  for (int i = 0; i < 300; ++i) {
    const V3d p(pattern.period_mm.x * random.uniform(), pattern.period_mm.y * random.uniform(),
                3.4 * random.uniform() - 1.7);
    double nearest = 1e9;
    for (const V3d& s : skeleton) nearest = std::min(nearest, (p - s).length());
    const double expected = std::min(nearest - pattern.yarns[0].radius_mm, 0.4);
    // Samples stand at most 0.01 apart: a point 0.005 beside the foot of a perpendicular d is further away by
    // 0.005^2 / 2d; a point on the skeleton itself by 0.005.
    CHECK(surface.distance(p) <= expected + 1e-12);
    CHECK(surface.distance(p) >= expected - std::min(0.005, 1.3e-5 / nearest));
  }
}

TEST_CASE("the gradient is the slope of the function, and a unit vector") {
  const ImplicitSurface surface = surface_of(ring(4, 1.2, 0.5));
  Random random(4);
  const double h = 1e-5;
  for (int i = 0; i < 200; ++i) {
    const double angle = 6.283 * random.uniform();
    const double around = 6.283 * random.uniform();
    const double r = 1.2 + 0.45 * std::cos(around);
    const V3d p(2 + r * std::cos(angle), 2 + r * std::sin(angle), 0.45 * std::sin(around));
    const SurfaceSample sample = surface.sample(p);
    CHECK(std::abs(sample.gradient.length() - 1) < 1e-14);
    CHECK(sample.yarn == 0);
    for (int axis = 0; axis < 3; ++axis) {
      V3d step(0);
      step[axis] = h;
      const double slope = (surface.distance(p + step) - surface.distance(p - step)) / (2 * h);
      // h^2 times curvature squared (1 / 0.45^2), and 1e-15 / h of rounding.
      CHECK(std::abs(slope - sample.gradient[axis]) < 1e-8);
    }
  }
}

TEST_CASE("refuses yarns too long for their radius") {
  StitchPattern pattern = cylinder(4, 1e-7);
  CHECK(test::error_of(ImplicitSurface::build(pattern, 0.1, "long")).code == Code::mesh_invalid);
}

TEST_CASE("refuses to compare thousands of yarns in one place, with each other or with a fine grid") {
  const auto many = [](double radius) {
    StitchPattern pattern = cylinder(4, radius);
    pattern.yarns.resize(3000, pattern.yarns.front());
    return pattern;
  };
  CHECK(test::need(minimum_clearance(many(7), "many")) == -14);
  // A thick yarn far above them: all thin ones are near enough to be looked at.
  StitchPattern thin = many(0.01);
  thin.yarns.resize(300);
  thin.yarns.push_back(many(7).yarns.front());
  for (BezierSegment& segment : thin.yarns.back().segments)
    for (V3d& p : segment) p.z += 30;
  CHECK(test::error_of(minimum_clearance(thin, "many")).code == Code::mesh_invalid);
  const Error error = test::error_of(mesh_stitch(many(0.5), {200}));
  CHECK(error.code == Code::mesh_invalid);
  CHECK(error.message.ends_with("for the grid"));
}

TEST_CASE("the clearance of parallel yarns is their spacing less their radii") {
  StitchPattern pattern = cylinder(4, 0.9);
  CHECK(*minimum_clearance(pattern, "") == 0.9);  // copies are 2.2 apart: beyond what is looked at
  pattern.yarns.push_back({"second", 0.4, {0, 0, 0}, {line({0, 3.5, 0.3}, {4, 3.5, 0.3})}});
  const double distance = std::hypot(1.5, 0.3);
  CHECK(*minimum_clearance(pattern, "") == doctest::Approx(distance - 1.3).epsilon(1e-12));
  pattern.yarns[1].radius_mm = 0.8;
  CHECK(*minimum_clearance(pattern, "") == doctest::Approx(distance - 1.7).epsilon(1e-12));
}

TEST_CASE("a yarn is not in its own way, but its other turns are") {
  CHECK(*minimum_clearance(cylinder(1, 0.45), "") == doctest::Approx(0.1).epsilon(1e-12));
  // Points nearer along a ring than pi radii do not count: the chord at that arc. Where the count begins is
  // known to a step of 1/16 radius, and the chord grows by 0.43 of that (the cosine of half the arc's angle).
  const double chord = 2 * 0.7 * std::sin(std::numbers::pi * 0.5 / (2 * 0.7));
  CHECK(std::abs(*minimum_clearance(ring(4, 0.7, 0.5), "") - (chord - 1)) < 0.43 * 0.5 / 16);
  // The next course of a slanted yarn is a copy of the same chain, further along.
  StitchPattern slanted{"slanted", {4, 1}, {}};
  slanted.yarns.push_back({"y", 0.4, {0, 0, 0}, {line({0, 0, 0}, {4, 1, 0})}});
  CHECK(*minimum_clearance(slanted, "") == doctest::Approx(4 / std::sqrt(17.0) - 0.8).epsilon(1e-9));
}

TEST_CASE("each of the 256 cases uses all crossed edges and no other") {
  for (unsigned inside = 0; inside < 256; ++inside) {
    std::set<int> used;
    for (const auto& triangle : triangles_of(inside)) used.insert(triangle.begin(), triangle.end());
    for (int e = 0; e < 12; ++e) {
      const unsigned a = inside >> edge_corner(e) & 1U;
      const unsigned b = inside >> (edge_corner(e) | 1 << e / 4) & 1U;
      CHECK(used.contains(e) == (a != b));
    }
  }
}

TEST_CASE("random signs give a closed surface: every edge twice, once each way") {
  // White noise meets all cases, ambiguous faces on both sides above all.
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    MarchingGrid grid{{8, 6}, {8, 6, 7}, 0, 1};
    const auto noise = [&](const V3d& p) {
      const V3i node(static_cast<int>(std::lround(p.x)) % 8, static_cast<int>(std::lround(p.y)) % 6,
                     static_cast<int>(std::lround(p.z)));
      if (node.z == 0 || node.z == 7) return 1.0;
      const auto key = static_cast<std::uint64_t>((node.z * 6 + node.y) * 8 + node.x);
      return Random(seed, key).uniform() - 0.5;
    };
    const MarchedSurface surface = marching_cubes(grid, noise);
    const Topology topology = topology_of(as_mesh(surface, grid.period), 1, true);
    CHECK(topology.faces > 500);
    CHECK(topology.unpaired_on_walls == 0);
    CHECK(topology.unpaired_elsewhere == 0);
    CHECK(topology.repeated == 0);
    CHECK(volume_of(as_mesh(surface, grid.period)) > 0);
  }
}

TEST_CASE("vertices on the far walls are copies of those on the near walls") {
  const double period = 3.8;  // no binary fraction
  const auto function = [&](const V3d& p) {
    return p.z - 0.3 * std::sin(2 * std::numbers::pi / period * (p.x + p.y));
  };
  const MarchedSurface surface = marching_cubes({{period, period}, {10, 10, 10}, -1.03, 0.2}, function);
  int copies = 0;
  for (std::size_t v = 0; v < surface.positions.size(); ++v) {
    const V3d& p = surface.positions[v];
    const V3d& q = surface.positions[surface.source_vertex[v]];
    const bool far = p.x == period || p.y == period;
    CHECK(far == (surface.source_vertex[v] != static_cast<int>(v)));
    if (!far) continue;
    ++copies;
    CHECK(q.x == (p.x == period ? 0 : p.x));
    CHECK(q.y == (p.y == period ? 0 : p.y));
    CHECK(q.z == p.z);
  }
  CHECK(copies > 20);
}
