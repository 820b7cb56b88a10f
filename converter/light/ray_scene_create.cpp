#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "converter/light/ray_scene_state.h"

namespace selvedge {
namespace {

/// Snaps coordinates on a wall to the same number in both cells, so that copies meet without gaps.
double snap_to_wall(double value, double period) {
  const double turns = value / period;
  const double nearest = std::round(turns);
  return std::abs(turns - nearest) < 1e-6 ? nearest * period : value;
}

/// Two triangles over the cell at z = 0. They count as yarn except in is_ground().
void add_ground(CellMesh& mesh, float albedo) {
  const int first = static_cast<int>(mesh.positions.size());
  const auto x = static_cast<float>(mesh.period.x);
  const auto y = static_cast<float>(mesh.period.y);
  for (const V3f& corner : {V3f(0, 0, 0), V3f(x, 0, 0), V3f(x, y, 0), V3f(0, y, 0)}) {
    mesh.positions.push_back(corner);
    mesh.normals.emplace_back(0.0F, 0.0F, 1.0F);
    mesh.albedo.emplace_back(albedo);
    if (!mesh.gloss.empty()) {
      mesh.fibres.emplace_back(1.0F, 0.0F, 0.0F);
      mesh.gloss.push_back({});
    }
  }
  mesh.triangles.emplace_back(first, first + 1, first + 2);
  mesh.triangles.emplace_back(first, first + 2, first + 3);
}

}  // namespace

Result<RayScene> RayScene::create(const CellMesh& mesh, const std::string& name,
                                  std::optional<float> ground) {
  auto state = std::make_unique<RaySceneState>();
  state->bounds = bounds_of(mesh);
  state->mesh = mesh;
  const V2d period = mesh.period;

  const double low_z = static_cast<double>(state->bounds.min.z);
  const double thickness = static_cast<double>(state->bounds.max.z) - low_z;
  const double size = std::max(period.x, period.y);
  state->offset =
      std::max(2e-5 * size, 8 * static_cast<double>(std::numeric_limits<float>::epsilon()) * thickness);
  state->z_low = -1e-3 * size;
  state->z_high = thickness + 1e-3 * size;

  // Shifted to the origin by whole periods and down to z = 0 in double precision, as single precision loses
  // the digits of a mesh that is far away.
  const auto whole_periods = [](double low, double length) {
    return std::floor(low / length + 1e-6) * length;
  };
  const V3d shift(whole_periods(state->bounds.min.x, period.x), whole_periods(state->bounds.min.y, period.y),
                  low_z);
  for (V3f& p : state->mesh.positions) p = V3f(V3d(p) - shift);
  state->bounds.min = V3f(V3d(state->bounds.min) - shift);
  state->bounds.max = V3f(V3d(state->bounds.max) - shift);
  state->ground_triangle = static_cast<int>(mesh.triangles.size());
  if (ground) add_ground(state->mesh, *ground);

  // Cells outside of the block whose triangles may reach into it.
  const auto overhang = [](double high, double length) {
    return static_cast<int>(std::ceil(std::max(0.0, high / length - 1) - 1e-6));
  };
  const int extra_x = overhang(state->bounds.max.x, period.x);
  const int extra_y = overhang(state->bounds.max.y, period.y);
  constexpr int max_extra = 8;
  if (extra_x > max_extra || extra_y > max_extra) {
    return fail(Code::mesh_invalid, name, "period",
                fmt::format("the mesh reaches {} periods beyond its cell; {} are allowed",
                            std::max(extra_x, extra_y), max_extra));
  }
  state->block_min = {-block_reach * period.x, -block_reach * period.y};
  state->block_max = {(1 + block_reach) * period.x, (1 + block_reach) * period.y};

  std::vector<V3f> vertices;
  std::vector<V3i> triangles;
  for (int cy = -block_reach - extra_y; cy <= block_reach + extra_y; ++cy) {
    for (int cx = -block_reach - extra_x; cx <= block_reach + extra_x; ++cx) {
      const int first = static_cast<int>(vertices.size());
      for (const V3f& p : state->mesh.positions) {
        vertices.emplace_back(
            V3f(V3d(snap_to_wall(static_cast<double>(p.x) + cx * period.x, period.x),
                    snap_to_wall(static_cast<double>(p.y) + cy * period.y, period.y), p.z)));
      }
      for (const V3i& t : state->mesh.triangles) triangles.push_back(t + V3i(first));
    }
  }
  if (triangles.empty()) return fail(Code::mesh_empty, name, {}, "the mesh has no triangles");

  state->device = rtcNewDevice(nullptr);
  if (state->device == nullptr) return fail(Code::mesh_invalid, name, {}, "the ray tracer cannot be started");
  state->scene = rtcNewScene(state->device);
  rtcSetSceneFlags(state->scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(state->scene, RTC_BUILD_QUALITY_HIGH);
  RTCGeometry geometry = rtcNewGeometry(state->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* vertex_buffer = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                sizeof(V3f), vertices.size());
  void* index_buffer = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                               sizeof(V3i), triangles.size());
  if (vertex_buffer == nullptr || index_buffer == nullptr) {
    rtcReleaseGeometry(geometry);
    return fail(Code::mesh_invalid, name, {}, "not enough memory for the ray tracer");
  }
  std::copy(vertices.begin(), vertices.end(), static_cast<V3f*>(vertex_buffer));
  std::copy(triangles.begin(), triangles.end(), static_cast<V3i*>(index_buffer));
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(state->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(state->scene);
  if (rtcGetDeviceError(state->device) != RTC_ERROR_NONE) {
    return fail(Code::mesh_invalid, name, {}, "the ray tracer refuses the mesh");
  }
  return RayScene(std::move(state));
}

}  // namespace selvedge
