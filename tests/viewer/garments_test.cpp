// Garments of others, from file to picture.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <tuple>

#include "format/gltf/read_scene.h"
#include "format/picture/image.h"
#include "format/scene/scene_points.h"
#include "tests/format/encoded_cloths.h"
#include "tests/require.h"
#include "tests/viewer/shapes.h"
#include "viewer/render.h"

namespace selvedge {
namespace {

/// What a way of encoding may do to the plain cloth.
struct Encoding {
  const char* name;
  int uv_bits;
  int position_bits;
};

/// For every vertex of `other` the vertex of `plain` at the same place, which is nearer than `reach`.
std::vector<std::size_t> partners(const std::vector<V3d>& plain, const std::vector<V3d>& other,
                                  double reach) {
  using Cell = std::tuple<long, long, long>;
  const auto cell_of = [&](const V3d& p, int dx, int dy, int dz) {
    return Cell(std::lround(p.x / reach) + dx, std::lround(p.y / reach) + dy, std::lround(p.z / reach) + dz);
  };
  std::map<Cell, std::vector<std::size_t>> cells;
  for (std::size_t i = 0; i < plain.size(); ++i) cells[cell_of(plain[i], 0, 0, 0)].push_back(i);
  std::vector<std::size_t> result;
  for (const V3d& p : other) {
    std::size_t best = plain.size();
    double least = HUGE_VAL;
    for (int i = 0; i < 27; ++i) {
      const auto found = cells.find(cell_of(p, i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
      if (found == cells.end()) continue;
      for (const std::size_t candidate : found->second) {
        const double distance = (plain[candidate] - p).length();
        if (distance < least) std::tie(best, least) = std::tuple(candidate, distance);
      }
    }
    result.push_back(best);
  }
  return result;
}

std::vector<V3d> world_positions(const Scene& scene) {
  std::vector<V3d> positions;
  for (const V3f& p : scene.primitives[0].positions) positions.push_back(V3d(p) * scene.instances[0].world);
  return positions;
}

}  // namespace

TEST_CASE("the encodings of one cloth have the same coordinates, within a step of each") {
  for (const std::string& prefix : test::encoded_cloths()) {
    CAPTURE(prefix);
    const auto file = [&](const char* name) { return prefix + name + ".glb"; };
    const Scene plain = test::need(read_scene(file("plain")));
    const std::vector<V3d> positions = world_positions(plain);
    const auto& uvs = plain.primitives[0].tex_coords[0];
    double extent = 0;
    double range = 0;
    for (int c = 0; c < 3; ++c) {
      double low = HUGE_VAL;
      double high = -HUGE_VAL;
      for (const V3d& p : positions)
        std::tie(low, high) = std::tuple(std::min(low, p[c]), std::max(high, p[c]));
      extent = std::max(extent, high - low);
    }
    for (int c = 0; c < 2; ++c) {
      for (const V2d& uv : uvs) range = std::max(range, std::abs(uv[c]));
    }
    // The encoder's own bits: gltf-transform's defaults.
    for (const Encoding& encoding : {Encoding{"draco_edgebreaker", 12, 14},
                                     Encoding{"draco_sequential", 12, 14}, Encoding{"quantized", 12, 14},
                                     Encoding{"meshopt_medium", 12, 14}, Encoding{"meshopt_high", 12, 14}}) {
      CAPTURE(encoding.name);
      const Scene scene = test::need(read_scene(file(encoding.name)));
      const ScenePrimitive& cloth = scene.primitives[0];
      REQUIRE(cloth.positions.size() == positions.size());
      const double position_step = extent / ((1 << encoding.position_bits) - 1);
      const std::vector<std::size_t> partner = partners(positions, world_positions(scene), 4 * position_step);
      const double uv_step = range / ((1 << encoding.uv_bits) - 1);
      double worst = 0;
      std::size_t alone = 0;
      for (std::size_t v = 0; v < partner.size(); ++v) {
        if (partner[v] == positions.size()) {
          ++alone;
          continue;
        }
        const V2d off = cloth.tex_coords[0][v] - uvs[partner[v]];
        worst = std::max({worst, std::abs(off.x), std::abs(off.y)});
      }
      CHECK(alone == 0);
      MESSAGE(std::string(encoding.name) << ": UVs off by " << worst / uv_step << " steps at most");
      CHECK(worst <= uv_step);
    }
  }
}

}  // namespace selvedge
