#include "converter/light/yarn_brdf.h"

#include <doctest/doctest.h>

#include <cmath>

#include "converter/light/path_tracer.h"
#include "converter/stitch/library.h"
#include "converter/stitch/yarn_mesh.h"
#include "tests/converter/load_cell.h"
#include "tests/require.h"

using namespace selvedge;

namespace {

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

}  // namespace

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
