#include "converter/stitch/marching_cubes.h"

#include <doctest/doctest.h>

#include <cmath>
#include <set>

#include "format/base/random.h"
#include "tests/converter/cells.h"

using namespace selvedge;
using namespace selvedge::testing;

namespace {

CellMesh as_mesh(const MarchedSurface& surface, const V2d& period) {
  CellMesh mesh;
  mesh.period = period;
  for (const V3d& p : surface.positions) mesh.positions.emplace_back(p);
  mesh.triangles = surface.triangles;
  return mesh;
}

}  // namespace

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
