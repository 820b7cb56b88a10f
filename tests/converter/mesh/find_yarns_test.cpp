#include "converter/mesh/find_yarns.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "converter/mesh/yarn_chain.h"
#include "converter/stitch/yarn_mesh.h"
#include "converter/stitch/yarn_plies.h"
#include "format/base/parallel.h"
#include "format/base/random.h"
#include "tests/converter/bake_cells.h"
#include "tests/converter/cells.h"
#include "tests/converter/load_cell.h"
#include "tests/require.h"

using namespace selvedge;

namespace {

/// The segments of a curve in a row: each is a start and an end.
std::vector<std::pair<V3d, V3d>> make_segments(const YarnData& data, std::size_t curve, const V2d& period) {
  std::size_t first = 0;
  for (std::size_t c = 0; c < curve; ++c) first += data.curves[c].nodes;
  const YarnCurve& c = data.curves[curve];
  std::vector<std::pair<V3d, V3d>> segments;
  for (int i = 0; i < c.nodes; ++i) {
    const V3d end = i + 1 < c.nodes ? V3d(data.nodes[first + i + 1])
                                    : V3d(data.nodes[first]) +
                                          V3d(c.repeat_offset.x * period.x, c.repeat_offset.y * period.y, 0);
    segments.emplace_back(V3d(data.nodes[first + i]), end);
  }
  return segments;
}

/// Root of the mean squared distance from the middles and ends of one chain to another, in all its copies.
double rms_between(const std::vector<std::pair<V3d, V3d>>& chain,
                   const std::vector<std::pair<V3d, V3d>>& other, const V2d& period) {
  double sum = 0;
  for (const auto& [start, end] : chain) {
    for (const V3d& p : {start, (start + end) * 0.5}) {
      double nearest = std::numeric_limits<double>::max();
      for (const auto& [a, b] : other) {
        const V3d way = p - (a + b) * 0.5;
        const V3d moved =
            p - V3d(std::round(way.x / period.x) * period.x, std::round(way.y / period.y) * period.y, 0);
        nearest = std::min(nearest, chord_distance(moved, a, b));
      }
      sum += nearest * nearest;
    }
  }
  return std::sqrt(sum / static_cast<double>(2 * chain.size()));
}

struct Bounds {
  double radius = 0.02;  ///< relative
  double rms = 0.03;     ///< of centre lines, in radii
  double albedo = 0.01;
  double fraction = 0.95;
};

/// Every found curve is near a true one of its turns and radius, and every true one near a found one.
void check_found(const CellMesh& mesh, const YarnData& truth, const Bounds& bounds = {}) {
  const FoundYarns found = find_yarns(mesh);
  CHECK(found.explained_fraction >= bounds.fraction);
  CHECK(found.explained_fraction <= 1);
  REQUIRE(found.yarns.curves.size() == truth.curves.size());
  YarnData lit = found.yarns;
  lit.station_light.resize(std::size_t{light_values_per_station} * counts_of(lit).stations);
  test::need(validate(lit, V2f(mesh.period)));
  std::vector<bool> taken(truth.curves.size(), false);
  for (std::size_t f = 0; f < found.yarns.curves.size(); ++f) {
    const auto chain = make_segments(found.yarns, f, mesh.period);
    std::size_t nearest = 0;
    double rms = std::numeric_limits<double>::max();
    for (std::size_t t = 0; t < truth.curves.size(); ++t) {
      const double distance = rms_between(chain, make_segments(truth, t, mesh.period), mesh.period);
      if (distance < rms) nearest = t;
      rms = std::min(rms, distance);
    }
    const YarnCurve& is = found.yarns.curves[f];
    const YarnCurve& was = truth.curves[nearest];
    CHECK(!taken[nearest]);
    taken[nearest] = true;
    CHECK(rms <= bounds.rms * static_cast<double>(was.radius));
    CHECK((is.repeat_offset == was.repeat_offset || is.repeat_offset == -was.repeat_offset));
    CHECK(std::abs(is.radius / was.radius - 1) <= bounds.radius);
    for (int k = 0; k < 3; ++k) CHECK(std::abs(is.albedo[k] - was.albedo[k]) <= bounds.albedo);
  }
}

/// The mesh of a stitch; `truth` is given its yarns, which the mesh loses.
CellMesh mesh_with(const StitchPattern& pattern, YarnData& truth) {
  CellMesh mesh = test::need(mesh_stitch(pattern));
  truth = std::move(mesh.yarns);
  mesh.yarns = {};
  return mesh;
}

StitchPattern pattern_of(const std::string& name, const StitchSettings& settings = {}) {
  return test::need(find_stitch(name, of_tubes(settings))).pattern;
}

/// A ball of radius 1 mm: 24 rings of 48 vertices.
CellMesh ball() {
  CellMesh mesh;
  mesh.period = V2d(5, 5);
  constexpr int rings = 24;
  constexpr int sides = 48;
  for (int r = 0; r <= rings; ++r) {
    for (int k = 0; k < sides; ++k) {
      const double from_pole = std::numbers::pi * r / rings;
      const double turn = 2 * std::numbers::pi * k / sides;
      mesh.normals.emplace_back(V3d(std::sin(from_pole) * std::cos(turn),
                                    std::sin(from_pole) * std::sin(turn), std::cos(from_pole)));
      mesh.positions.push_back(V3f(2.5F, 2.5F, 0) + mesh.normals.back());
      if (r == rings) continue;
      const int next = r * sides + (k + 1) % sides;
      mesh.triangles.emplace_back(r * sides + k, (r + 1) * sides + k, next);
      mesh.triangles.emplace_back(next, (r + 1) * sides + k, next + sides);
    }
  }
  mesh.albedo.assign(mesh.positions.size(), V3f(0.5F));
  return mesh;
}

/// The normals of a file without any: area-weighted means over the faces.
void recompute_normals(CellMesh& mesh) {
  std::vector<V3f> normals(mesh.positions.size(), V3f(0, 0, 0));
  for (const V3i& t : mesh.triangles) {
    const V3f n =
        (mesh.positions[t.y] - mesh.positions[t.x]).cross(mesh.positions[t.z] - mesh.positions[t.x]);
    for (int k = 0; k < 3; ++k) normals[t[k]] += n;
  }
  for (std::size_t v = 0; v < normals.size(); ++v) mesh.normals[v] = normals[v].normalized();
}

}  // namespace

// The mesh's own yarns are exact. Touching yarns are joined by the cubes; colours mix where they touch.
TEST_CASE("the yarns of stitches are found in their meshes: curves, turns, radii and centre lines") {
  for (const char* name : {"plain-knit", "garter", "two-colour", "plain-weave", "denim"}) {
    CAPTURE(name);
    YarnData truth;
    const CellMesh mesh = mesh_with(pattern_of(name), truth);
    check_found(mesh, truth);
  }
}

TEST_CASE("plies are found one by one") {
  YarnData truth;
  StitchPattern pattern = pattern_of("plain-knit", {{"plies", {3}}});
  const CellMesh mesh = mesh_with(pattern, truth);
  check_found(mesh, test::need(yarn_curves_of(test::need(lay_plies(pattern, "plies")))));
}

TEST_CASE("a ring and a straight yarn of few triangles are found") {
  for (const StitchPattern& pattern : {testing::cylinder(4, 0.6), testing::ring(5, 1.4, 0.5)}) {
    YarnData truth;
    const CellMesh mesh = mesh_with(pattern, truth);
    check_found(mesh, truth);
  }
}

TEST_CASE("noise, missing normals, a new scale and place, and a quarter turn do not hide yarns") {
  YarnData truth;
  CellMesh mesh = mesh_with(pattern_of("plain-weave"), truth);
  SUBCASE("noise of 0.01 radii, normals of the noisy faces") {
    Random random(1);
    for (V3f& p : mesh.positions) {
      for (int k = 0; k < 3; ++k) {
        const double gauss = std::sqrt(-2 * std::log(1 - random.uniform())) *
                             std::cos(2 * std::numbers::pi * random.uniform());
        p[k] += static_cast<float>(0.01 * gauss) * truth.curves.front().radius;
      }
    }
    recompute_normals(mesh);
    check_found(mesh, truth, {.fraction = 0.9});
  }
  SUBCASE("in metres for millimetres, away from the origin, turned about z") {
    const auto turned = [&](const V3f& v) { return V3f(-v.y, v.x, v.z); };
    const auto placed = [&](const V3f& v) { return turned(v) * 1e-3F + V3f(0.011F, -0.004F, 0.7F * 1e-2F); };
    for (V3f& p : mesh.positions) p = placed(p);
    for (V3f& n : mesh.normals) n = turned(n);
    for (V3f& n : truth.nodes) n = placed(n);
    for (YarnCurve& c : truth.curves) {
      c.radius *= 1e-3F;
      c.repeat_offset = {-c.repeat_offset.y, c.repeat_offset.x};
    }
    mesh.period = V2d(mesh.period.y, mesh.period.x) * 1e-3;
    check_found(mesh, truth);
  }
}

TEST_CASE("the threads do not change what is found") {
  YarnData truth;
  const CellMesh mesh = mesh_with(testing::ring(5, 1.4, 0.5), truth);
  set_thread_limit(1);
  const YarnData by_one = find_yarns(mesh).yarns;
  set_thread_limit(0);
  CHECK(find_yarns(mesh).yarns == by_one);
}

TEST_CASE("a plane, a fence, grooves, a ball and a flat band are no yarn") {
  YarnData truth;
  CellMesh band = mesh_with(testing::cylinder(4, 0.5), truth);
  for (V3f& p : band.positions) p.z *= 0.25F;
  recompute_normals(band);
  for (const CellMesh& mesh :
       {test::floor_of(5, 1, 0.5F), test::fence(5, 3, 0.5F, 0.5F), test::groove(5, 1, 0.5F), ball(), band})
    CHECK(find_yarns(mesh).explained_fraction < 0.3);
}

TEST_CASE("open ends and colours that change along a yarn are not represented") {
  YarnData truth;
  CellMesh mesh = mesh_with(testing::cylinder(4, 0.5), truth);
  SUBCASE("a gap of a third of the repeat") {
    std::erase_if(mesh.triangles, [&](const V3i& t) { return mesh.positions[t.x].x < 1.4F; });
    CHECK(find_yarns(mesh).yarns.curves.empty());
    CHECK(find_yarns(mesh).explained_fraction == 0);
  }
  SUBCASE("two colours, half and half") {
    for (std::size_t v = 0; v < mesh.positions.size(); ++v)
      mesh.albedo[v] = mesh.positions[v].x < 2 ? V3f(0.1F, 0.1F, 0.1F) : V3f(0.9F, 0.9F, 0.9F);
    CHECK(find_yarns(mesh).yarns.curves.size() == 1);
    CHECK(find_yarns(mesh).explained_fraction < 0.1);
  }
}
