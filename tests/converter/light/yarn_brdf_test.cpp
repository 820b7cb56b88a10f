#include "converter/light/yarn_brdf.h"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "converter/light/path_tracer.h"
#include "converter/stitch/library.h"
#include "converter/stitch/yarn_mesh.h"
#include "tests/converter/load_cell.h"
#include "tests/require.h"

using namespace selvedge;

namespace {

constexpr double pi = std::numbers::pi;

YarnBrdf yarn(double albedo, float weight, float roughness, float lustre = 0) {
  YarnBrdf s;
  s.normal = V3d(0.2, -0.3, 0.8).normalized();
  s.fibre_direction = s.normal.cross(V3d(0, 1, 0)).normalized();
  s.albedo = V3d(albedo);
  s.gloss = {weight, roughness, lustre};
  return s;
}

/// Unit, at this elevation's cosine and azimuth from the fibre.
V3d direction(const YarnBrdf& s, double cosine, double azimuth) {
  const double planar = std::sqrt(1 - cosine * cosine);
  return s.fibre_direction * (planar * std::cos(azimuth)) +
         s.normal.cross(s.fibre_direction) * (planar * std::sin(azimuth)) + s.normal * cosine;
}

/// Fraction of the light from `l` that is reflected, by the midpoint rule.
double albedo_by_quadrature(const YarnBrdf& s, const V3d& l) {
  constexpr int rows = 300;
  constexpr int columns = 600;
  double sum = 0;
  for (int i = 0; i < rows; ++i) {
    // Equal steps of the squared cosine: the cosine's weight is in them.
    const double cosine = std::sqrt((i + 0.5) / rows);
    for (int j = 0; j < columns; ++j)
      sum += reflectance(s, l, direction(s, cosine, 2 * pi * (j + 0.5) / columns)).x;
  }
  return sum * pi / (rows * columns);
}

CellMesh knit(const StitchSettings& settings) {
  return test::need(mesh_stitch(test::need(find_stitch("plain-knit", of_tubes(settings))).pattern));
}

/// Calls visit(point) where rays from straight above meet the cell.
template <class Visit>
void look_down(const RayScene& scene, const Visit& visit) {
  constexpr std::uint32_t count = 20000;
  for (std::uint32_t i = 0; i < count; ++i) {
    const V2d at = sobol_point(i, 1);
    SurfacePoint point;
    if (scene.trace({at.x * scene.period().x, at.y * scene.period().y, 10}, {0, 0, -1}, point)) visit(point);
  }
}

/// A square of 1 x 1 at height 0, with a straight hair along x above it at y = 0.5, which begins at `x` and
/// is 1 long: it covers 2 * radius of the cell.
CellMesh square_with_hair(float x, float radius, float passed) {
  CellMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.normals.assign(4, {0, 0, 1});
  mesh.albedo.assign(4, {0.25F, 0.5F, 0.75F});
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  for (int k = 0; k < Hairs::points_per_hair; ++k)
    mesh.hairs.points.emplace_back(x + static_cast<float>(k) / (Hairs::points_per_hair - 1), 0.5F, 1.0F);
  mesh.hairs.root_triangles = {1};
  mesh.hairs.radius = {radius};
  mesh.hairs.transparency = {passed};
  return mesh;
}

}  // namespace

TEST_CASE("yarn is reciprocal") {
  const YarnBrdf s = yarn(0.4, 0.7F, 0.2F, 0.5F);
  for (std::uint32_t i = 0; i < 200; ++i) {
    PathSampler sampler(i, 1);
    const V3d a = cosine_direction(s.normal, sampler.next_pair());
    const V3d b = cosine_direction(s.normal, sampler.next_pair());
    CHECK(reflectance(s, a, b).x == doctest::Approx(reflectance(s, b, a).x).epsilon(1e-12));
  }
}

TEST_CASE("yarn reflects no more light than falls on it, from any direction") {
  for (const auto& [roughness, weight] : {std::pair(0.1F, 1.0F), {0.3F, 1.0F}, {1.0F, 1.0F}, {0.2F, 0.3F}}) {
    const float lustre = weight < 1 ? 0.5F : 0.0F;
    const YarnBrdf white = yarn(1, weight, roughness, lustre);
    for (const double cosine : {0.02, 0.1, 0.3, 0.6, 0.9, 1.0}) {
      for (const double azimuth : {0.0, 0.4, 0.8, 1.2, pi / 2}) {
        const V3d l = direction(white, cosine, azimuth);
        const double albedo = albedo_by_quadrature(white, l);
        CAPTURE(roughness);
        CAPTURE(cosine);
        CAPTURE(azimuth);
        // 180,000 points: at a width of 0.1 the midpoint rule is good to 1e-3 from almost level.
        CHECK(albedo <= 1 + 1e-3);
        CHECK(albedo > 0.3);
        // A second way to the same integral: what the sampling of paths keeps.
        double kept = 0;
        constexpr std::uint32_t count = 4096;
        for (std::uint32_t i = 0; i < count; ++i) {
          PathSampler sampler(i, 2);
          if (const auto sample = sample_bsdf(white, l, sampler.next_pair()))
            kept += sample->weight.x / count;
        }
        // Weights lie in [0, 2]: deviation of the mean at most 1 / 128, less by even spreading.
        CHECK(std::abs(kept - albedo) < 4.0 / 128);
      }
    }
  }
}

TEST_CASE("yarn with lustre reflects all light that matt yarn does, most of it about the mirror direction") {
  for (const float lustre : {0.02F, 0.1F, 0.5F, 0.75F, max_lustre}) {
    CAPTURE(lustre);
    const YarnBrdf s = yarn(0.6, 0, 0.3F, lustre);
    for (const double azimuth : {0.0, 0.7, pi / 2}) {
      for (const double cosine : {0.1, 0.5, 1.0}) {
        const V3d l = direction(s, cosine, azimuth);
        CHECK(albedo_by_quadrature(s, l) == doctest::Approx(0.6).epsilon(2e-3));
        constexpr std::uint32_t count = 16384;
        double mean = 0;
        for (std::uint32_t i = 0; i < count; ++i) {
          PathSampler sampler(i, 4);
          if (const auto sample = sample_bsdf(s, l, sampler.next_pair())) mean += sample->weight.x / count;
        }
        CHECK(mean == doctest::Approx(0.6).epsilon(0.01));
      }
    }
    const V3d l = direction(s, 0.7, 0);
    CHECK(reflectance(s, l, direction(s, 0.7, pi)).x > reflectance(s, l, l).x);
  }
}

TEST_CASE("any power of two of spread points is spread over every elementary interval") {
  for (const std::uint64_t seed : {1ULL, 0x123456789abcdef0ULL}) {
    for (int k = 0; k <= 8; ++k) {
      const int count = 1 << k;
      for (int columns = 1; columns <= count; columns *= 2) {
        std::vector<int> in(static_cast<std::size_t>(count), 0);
        for (int i = 0; i < count; ++i) {
          const V2d p = sobol_point(static_cast<std::uint32_t>(i), seed);
          const int rows = count / columns;
          ++in[static_cast<int>(p.x * columns) * rows + static_cast<int>(p.y * rows)];
        }
        CHECK(std::count(in.begin(), in.end(), 1) == count);
      }
    }
  }
}

TEST_CASE("strands of fibres turn normals and fibres and keep the mean colour") {
  const auto scene = test::need(RayScene::create(
      knit({{"yarn", {2}}, {"hairiness", {0}}, {"transmission", {0}}, {"irregularity", {0}}}), "wool"));
  V3d mean(0, 0, 0);
  V3d mean_mesh(0, 0, 0);
  double turned = 0;
  int count = 0;
  look_down(scene, [&](const SurfacePoint& point) {
    const YarnBrdf s = brdf_at(scene, point);
    CHECK(s.normal.length() == doctest::Approx(1));
    CHECK(s.fibre_direction.length() == doctest::Approx(1));
    CHECK(std::abs(s.normal.dot(s.fibre_direction)) < 1e-6);
    CHECK(s.normal.z > 0);
    mean += s.albedo;
    mean_mesh += V3d(scene.albedo(point));
    turned += std::acos(std::min(1.0, s.normal.dot(V3d(point.face_normal))));
    ++count;
  });
  CHECK(mean.x == doctest::Approx(mean_mesh.x).epsilon(0.02));
  CHECK(turned / count > 0.1);
  CHECK(turned / count < 0.5);
}

TEST_CASE("rays meet the strands on the mesh that a file's yarn has there") {
  for (const double plies : {1, 3}) {
    const CellMesh mesh =
        knit({{"yarn", {3}}, {"plies", {plies}}, {"hairiness", {0}}, {"transmission", {0}}});
    const auto scene = test::need(RayScene::create(mesh, "silk"));
    const V2f period(mesh.period);
    const Yarns yarns(mesh.yarns, period);
    int met = 0;
    int same = 0;
    int same_shade = 0;
    look_down(scene, [&](const SurfacePoint& point) {
      const V2d uv(static_cast<double>(point.position.x / period.x),
                   static_cast<double>(-point.position.y / period.y));
      const auto hit = yarns.trace(uv, 0, {0, 0, 1});
      // Rims are the mesh's, not the round yarn's.
      if (!hit || point.face_normal.z < 0.5F) return;
      YarnPoint seen = yarns.point_at(*hit);
      yarns.perturb_by_strands(seen, {0, 0, 1});
      const YarnBrdf traced = brdf_at(scene, point);
      ++met;
      same += (traced.normal - V3d(seen.strand_normal)).length() < 0.3 ? 1 : 0;
      const double shade = traced.albedo.x / static_cast<double>(scene.albedo(point).x);
      same_shade += std::abs(shade - static_cast<double>(seen.brightness)) < 0.02 ? 1 : 0;
    });
    MESSAGE(plies, " plies: ", met, " points, of the same normal ", same, ", of the same shade ", same_shade);
    CHECK(met > 5000);
    // Others lie near the edge of a strand, which places on a mesh miss by hundredths of a turn of a strand.
    CHECK(same > 0.85 * met);
    CHECK(same_shade > 0.85 * met);
  }
}

TEST_CASE("rays count the cover of hairs less what these pass, singly and in packets, across the walls") {
  for (const float x : {0.0F, 0.7F, -3.3F}) {
    for (const float passed : {0.0F, 0.32F}) {
      CAPTURE(x);
      CAPTURE(passed);
      const auto scene = test::need(RayScene::create(square_with_hair(x, 0.1F, passed), "hair"));
      constexpr int side = 120;
      int met = 0;
      int shadows = 0;
      for (int i = 0; i < side * side; ++i) {
        const int row = i / side;
        const V3d origin((i % side + 0.5) / side, (row + 0.5) / side, 2);
        SurfacePoint point;
        REQUIRE(scene.trace(origin, {0, 0, -1}, point));
        met += point.hair_point >= 0;
        SurfacePoint below{.position = V3f(V3d(origin.x, origin.y, 0))};
        shadows += scene.is_occluded(below, {0, 0, 1});
      }
      const double expected = 0.2 * (1 - static_cast<double>(passed)) * side * side;
      CHECK(met == doctest::Approx(expected).epsilon(0.05));
      CHECK(shadows == doctest::Approx(expected).epsilon(0.05));
    }
  }
}

TEST_CASE("a hair has its root's colour, a round normal and its own direction as the fibre's") {
  CellMesh mesh = square_with_hair(0, 0.1F, 0);
  mesh.fibre_directions.assign(4, {0, 1, 0});
  mesh.gloss.assign(4, {0.2F, 0.3F});
  const auto scene = test::need(RayScene::create(mesh, "hair"));
  SurfacePoint point;
  REQUIRE(scene.trace({0.01, 0.501, 3}, {0, 0, -1}, point));
  REQUIRE(point.hair_point >= 0);
  const YarnBrdf s = brdf_at(scene, point);
  CHECK(s.normal.length() == doctest::Approx(1));
  CHECK(std::abs(s.normal.dot(s.fibre_direction)) < 1e-6);
  CHECK(s.normal.z > 0.95);  // in the middle of the hair
  CHECK(std::abs(s.fibre_direction.x) == doctest::Approx(1).epsilon(1e-6));
  CHECK(s.albedo == V3d(0.25, 0.5, 0.75));
  CHECK(s.gloss.weight == doctest::Approx(0.2));
  CHECK(s.gloss.roughness == doctest::Approx(0.3));
  CHECK(scene.vertex_normal(point) == point.face_normal);
  // Bounds are the surface's, without hairs.
  CHECK(scene.bounds().max.z == 0);
}
