#include "converter/stitch/yarn_mesh.h"

#include <doctest/doctest.h>

#include <cmath>

#include "converter/stitch/implicit_surface.h"
#include "converter/stitch/library.h"
#include "converter/stitch/marching_cubes.h"
#include "converter/stitch/yarn_tubes.h"
#include "tests/converter/cells.h"
#include "tests/converter/load_cell.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::testing;

namespace {

CellMesh mesh_of(const StitchPattern& pattern, int cells) {
  auto mesh = test::need(mesh_stitch(pattern, {cells}));
  CHECK(validate(mesh, pattern.name));
  return mesh;
}

/// log2 of how much the error shrinks from one grid to one twice as fine.
double order(double coarse, double fine, double exact) {
  return std::log2(std::abs(coarse - exact) / std::abs(fine - exact));
}

void check_closed(const Topology& topology) {
  CHECK(topology.unpaired_on_walls == 0);
  CHECK(topology.unpaired_elsewhere == 0);
  CHECK(topology.repeated == 0);
}

}  // namespace

TEST_CASE("area and volume of a ring converge to the torus's, with order 2") {
  const double area = 4 * std::numbers::pi * std::numbers::pi * 1.1 * 0.53;
  const double volume = 2 * std::numbers::pi * std::numbers::pi * 1.1 * 0.53 * 0.53;
  const CellMesh coarse = mesh_of(ring(4, 1.1, 0.53), 24);
  const CellMesh fine = mesh_of(ring(4, 1.1, 0.53), 96);
  CHECK(std::abs(area_of(coarse) / area - 1) < 0.02);
  CHECK(std::abs(volume_of(coarse) / volume - 1) < 0.03);
  CHECK(order(area_of(coarse), area_of(fine), area) / 2 > 1.8);
  CHECK(order(volume_of(coarse), volume_of(fine), volume) / 2 > 1.8);
}

TEST_CASE("a ring's mesh is one closed surface with one hole, wherever the walls cut it") {
  StitchPattern pattern = ring(4, 1.1, 0.53);
  for (const V3d& shift : {V3d(0, 0, 0), V3d(2, 1.3, 0)}) {
    for (BezierSegment& segment : pattern.yarns[0].segments)
      for (V3d& p : segment) p += shift;
    const Topology topology = topology_of(mesh_of(pattern, 33), 1, true);
    check_closed(topology);
    CHECK(topology.components == 1);
    CHECK(topology.euler() == 0);
  }
}

TEST_CASE("the built-in stitches tile without seam or overlap") {
  for (const StitchPattern& pattern : {plain_knit(), plain_weave()}) {
    CAPTURE(pattern.name);
    const CellMesh mesh = mesh_of(pattern, 40);
    // Alone: open at the walls and nowhere else.
    const Topology alone = topology_of(mesh, 1, false);
    CHECK(alone.unpaired_on_walls > 0);
    CHECK(alone.unpaired_elsewhere == 0);
    CHECK(alone.repeated == 0);
    // Nine copies: open only at the outermost walls, three times as long.
    const Topology nine = topology_of(mesh, 3, false);
    CHECK(nine.unpaired_on_walls == 3 * alone.unpaired_on_walls);
    CHECK(nine.unpaired_elsewhere == 0);
    CHECK(nine.repeated == 0);
    check_closed(topology_of(mesh, 3, true));
  }
}

TEST_CASE("both sides of a wall are the same bits: positions, normals, albedo") {
  const CellMesh mesh = mesh_of(plain_weave(), 40);
  const auto px = static_cast<float>(mesh.period.x);
  std::map<std::pair<float, float>, std::size_t> near;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v)
    if (mesh.positions[v].x == 0) near[{mesh.positions[v].y, mesh.positions[v].z}] = v;
  std::size_t twins = 0;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    CHECK(mesh.positions[v].x >= 0);
    CHECK(mesh.positions[v].x <= px);
    if (mesh.positions[v].x != px) continue;
    const auto twin = near.find({mesh.positions[v].y, mesh.positions[v].z});
    REQUIRE(twin != near.end());
    CHECK(mesh.normals[twin->second] == mesh.normals[v]);
    CHECK(mesh.albedo[twin->second] == mesh.albedo[v]);
    ++twins;
  }
  CHECK(twins == near.size());
  CHECK(twins > 10);
}

TEST_CASE("vertices lie on the surface, normals point out of the yarn") {
  for (const StitchPattern& pattern : {plain_knit(), plain_weave(), ring(4, 1.1, 0.53)}) {
    CAPTURE(pattern.name);
    const CellMesh mesh = mesh_of(pattern, 40);
    const auto surface = ImplicitSurface::build(pattern, 0.5, "");
    const double step = std::max(pattern.period_mm.x, pattern.period_mm.y) / 40;
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
      const V3d p(mesh.positions[v]);
      // Allowed by edge_margin, a wall's rounded step included, and the rounding of floats.
      CHECK(std::abs(surface->distance(p)) < 1.1 * edge_margin * step + 1e-6);
      CHECK(std::abs(mesh.normals[v].length() - 1) < 1e-6);
    }
    // Triangles are small against the radius, but at creases between yarns two normals differ by up to 180
    // degrees: there a triangle need agree with one of its vertices only, and the smallest with none.
    double inward = 0;
    double all = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      double most = -1;
      for (int k = 0; k < 3; ++k) {
        const V3d normal(mesh.normals[mesh.triangles[t][k]]);
        most = std::max(most, normal.dot(twice_area(mesh, t).normalized()));
      }
      all += twice_area(mesh, t).length();
      if (most <= 0) inward += twice_area(mesh, t).length();
    }
    CHECK(inward < 1e-4 * all);
  }
}

TEST_CASE("tubes lie on the surface of their yarn and are closed") {
  for (const StitchPattern& pattern : {plain_weave(), ring(4, 1.1, 0.53)}) {
    CAPTURE(pattern.name);
    const YarnTubes tubes = tubes_of(pattern);
    const auto surface = test::need(ImplicitSurface::build(pattern, 0.5, ""));
    double farthest = 0;
    for (const V3d& p : tubes.surface.positions) farthest = std::max(farthest, std::abs(surface.distance(p)));
    CHECK(farthest < 1e-3);
    std::map<std::pair<int, int>, int> edges;
    for (const V3i& t : tubes.surface.triangles)
      for (int k = 0; k < 3; ++k)
        ++edges[{tubes.surface.source_vertex[t[k]], tubes.surface.source_vertex[t[(k + 1) % 3]]}];
    for (const auto& [edge, count] : edges) {
      CHECK(count == 1);
      CHECK(edges.count({edge.second, edge.first}) == 1);
    }
  }
}

TEST_CASE("sizes at the default grid are as in the paper, for every built-in stitch, and more on request") {
  for (const StitchInfo& info : built_in_stitches()) {
    CAPTURE(info.name);
    const StitchPattern pattern = find_stitch(info.name, of_tubes())->pattern;
    const auto mesh = test::need(mesh_stitch(pattern));
    MESSAGE(info.name, ": ", mesh.positions.size(), " vertices, ", mesh.triangles.size(), " triangles");
    // Daubert et al. 2001, section 7: 1,300 to 23,000 vertices, 2,400 to 31,000 triangles.
    CHECK(mesh.positions.size() >= 1300);
    CHECK(mesh.positions.size() <= 23000);
    CHECK(mesh.triangles.size() >= 2400);
    CHECK(mesh.triangles.size() <= 31000);
  }
  CHECK(mesh_of(plain_knit(), 120).positions.size() > 23000);
}

TEST_CASE("fibres run along the yarn, turned by its twist, and are there where a yarn is glossy") {
  StitchPattern pattern = cylinder(4, 0.5);
  CHECK(mesh_of(pattern, 32).fibre_directions.empty());
  pattern.yarns[0].gloss = {0.3F, 0.2F};
  pattern.yarns[0].twist_per_mm = 0.25;
  const CellMesh mesh = mesh_of(pattern, 32);
  REQUIRE(mesh.fibre_directions.size() == mesh.positions.size());
  for (std::size_t v = 0; v < mesh.fibre_directions.size(); ++v) {
    CHECK(mesh.gloss[v] == Gloss{0.3F, 0.2F});
    const V3d fibre(mesh.fibre_directions[v]);
    CHECK(std::abs(fibre.dot(V3d(mesh.normals[v]))) < 1e-5);
    // A helix of radius r and f turns per mm climbs by atan(2 pi r f).
    const double angle = std::atan(2 * std::numbers::pi * 0.5 * 0.25);
    CHECK(fibre.x == doctest::Approx(std::cos(angle)).epsilon(1e-4));
    // Z-twist is a right-handed screw: from the top of the yarn (+z) on towards +x it turns to the right
    // (-y).
    if (mesh.normals[v].z > 0.9F) CHECK(fibre.y < 0);
  }
}

TEST_CASE("plies make a mesh that is closed round the torus of cells, with fibres along them") {
  StitchPattern pattern = cylinder(4, 0.6);
  pattern.yarns[0].plies = 3;
  pattern.yarns[0].twist_per_mm = 0.25;
  pattern.yarns[0].gloss.weight = 0.1F;
  const CellMesh mesh = mesh_of(pattern, 80);
  check_closed(topology_of(mesh, 1, true));
  REQUIRE(mesh.fibre_directions.size() == mesh.positions.size());
  // Helices at offset a climb by atan(2 pi a f).
  const double offset = 0.6 * (1 - std::sin(std::numbers::pi / 3) / (1 + std::sin(std::numbers::pi / 3)));
  const double cosine = std::cos(std::atan(2 * std::numbers::pi * offset * 0.25));
  for (const V3f& fibre : mesh.fibre_directions)
    CHECK(std::abs(fibre.x) == doctest::Approx(cosine).epsilon(0.01));
}

TEST_CASE("refuses grids too coarse, too fine or out of range") {
  for (const int cells : {3, 0, -1, 1025})
    CHECK(test::error_of(mesh_stitch(plain_knit(), {cells})).code == Code::option_out_of_range);
  CHECK(to_line(test::error_of(mesh_stitch(plain_knit(), {5}))) ==
        "plain-knit: --grid: 5 are too few for a yarn of radius 0.6 mm, at least 9 "
        "[OPTION_OUT_OF_RANGE]");
  CHECK(test::error_of(mesh_stitch(plain_knit(), {1000})).code == Code::option_out_of_range);
}
