#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "converter/light/ray_scene_state.h"
#include "converter/light/shown_backs.h"
#include "format/base/random.h"

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
    if (!mesh.places.empty()) mesh.places.emplace_back();
    if (!mesh.transmission.empty()) mesh.transmission.push_back(0);
    if (!mesh.gloss.empty()) {
      mesh.fibres.emplace_back(1.0F, 0.0F, 0.0F);
      mesh.gloss.push_back({});
    }
  }
  mesh.triangles.emplace_back(first, first + 1, first + 2);
  mesh.triangles.emplace_back(first, first + 2, first + 3);
}

/// Copies triangles into the scene; `filter` decides about hits. False without memory.
bool attach(RaySceneState& state, const std::vector<V3f>& vertices, const std::vector<V3i>& triangles,
            RTCFilterFunctionN filter = nullptr) {
  RTCGeometry geometry = rtcNewGeometry(state.device, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* vertex_buffer = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                sizeof(V3f), vertices.size());
  void* index_buffer = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                               sizeof(V3i), triangles.size());
  const bool whole = vertex_buffer != nullptr && index_buffer != nullptr;
  if (whole) {
    std::copy(vertices.begin(), vertices.end(), static_cast<V3f*>(vertex_buffer));
    std::copy(triangles.begin(), triangles.end(), static_cast<V3i*>(index_buffer));
    if (filter != nullptr) {
      rtcSetGeometryUserData(geometry, &state);
      rtcSetGeometryIntersectFilterFunction(geometry, filter);
      rtcSetGeometryOccludedFilterFunction(geometry, filter);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(state.scene, geometry);
  }
  rtcReleaseGeometry(geometry);
  return whole;
}

/// Rays that begin on a hair do not meet it again: hairs nearer than so many of their radii are passed.
constexpr float near_radii = 4;

/// Lets the share `passed` of rays go on, by a number that belongs to the ray and the hair.
void pass_hairs(const RTCFilterFunctionNArguments* args) {
  const auto& state = *static_cast<const RaySceneState*>(args->geometryUserPtr);
  const Hairs& hairs = state.mesh.hairs;
  const unsigned n = args->N;
  for (unsigned i = 0; i < n; ++i) {
    if (args->valid[i] != -1) continue;
    const int hair = hair_point_of(hairs, RTCHitN_primID(args->hit, n, i)) / Hairs::points_each;
    const auto bits = [](float x) { return static_cast<std::uint64_t>(std::bit_cast<std::uint32_t>(x)); };
    RTCRayN* const ray = args->ray;
    const std::uint64_t origin = bits(RTCRayN_org_x(ray, n, i)) << 32U ^ bits(RTCRayN_org_y(ray, n, i));
    const std::uint64_t direction = bits(RTCRayN_dir_x(ray, n, i)) << 32U ^ bits(RTCRayN_dir_y(ray, n, i));
    const std::uint64_t drawn = mix(mix(origin ^ mix(direction)) ^ static_cast<std::uint64_t>(hair));
    const bool near = RTCRayN_tfar(ray, n, i) < near_radii * hairs.radius[hair];
    if (near || static_cast<float>(drawn >> 40U) * 0x1.0p-24F < hairs.passed[hair]) args->valid[i] = 0;
  }
}

/// Both edges of a hair's ribbon at each of its points: it turns about itself by half a turn. Seen from
/// anywhere, a ribbon of width pi r then covers 2 r on average, as a round hair does.
void add_edges(const Hairs& hairs, std::size_t hair, std::vector<V3f>& edges) {
  const V3f* const points = &hairs.points[hair * Hairs::points_each];
  const double half_width = 0.5 * std::numbers::pi * static_cast<double>(hairs.radius[hair]);
  V3d across(0, 0, 0);
  for (int k = 0; k < Hairs::points_each; ++k) {
    const int next = std::min(k + 1, Hairs::points_each - 1);
    V3d along(points[next] - points[next - 1]);
    along = along.length() > 0 ? along.normalized() : V3d(1, 0, 0);
    if (k == 0) across = along.cross(std::abs(along.z) < 0.9 ? V3d(0, 0, 1) : V3d(1, 0, 0));
    across = (across - along * across.dot(along)).normalized();
    const double turn = std::numbers::pi * k / (Hairs::points_each - 1);
    const V3d edge = (across * std::cos(turn) + along.cross(across) * std::sin(turn)) * half_width;
    edges.emplace_back(V3d(points[k]) - edge);
    edges.emplace_back(V3d(points[k]) + edge);
  }
}

/// The hairs of all cells that reach into the block; true if there are none.
bool attach_hairs(RaySceneState& state) {
  const Hairs& hairs = state.mesh.hairs;
  if (hairs.roots.empty()) return true;
  const V2d period = state.mesh.period;
  V2d low(0, 0);
  V2d high(period);
  for (std::size_t k = 0; k < hairs.points.size(); ++k) {
    const V3d p(hairs.points[k]);
    for (int i = 0; i < 2; ++i) {
      low[i] = std::min(low[i], p[i]);
      high[i] = std::max(high[i], p[i]);
    }
    // Rays begin where they enter the slab: further from a hair than what is passed.
    const auto clear = static_cast<double>(2 * near_radii * hairs.radius[k / Hairs::points_each]);
    state.block.z_low = std::min(state.block.z_low, p.z - clear);
    state.block.z_high = std::max(state.block.z_high, p.z + clear);
  }
  std::vector<V3f> edges;
  for (std::size_t h = 0; h < hairs.roots.size(); ++h) add_edges(hairs, h, edges);
  const auto cells = [](double overhang, double length) {
    return block_reach + static_cast<int>(std::ceil(overhang / length));
  };
  std::vector<V3f> vertices;
  std::vector<V3i> triangles;
  for (int cy = -cells(high.y - period.y, period.y); cy <= cells(-low.y, period.y); ++cy) {
    for (int cx = -cells(high.x - period.x, period.x); cx <= cells(-low.x, period.x); ++cx) {
      const int first = static_cast<int>(vertices.size());
      const V3d shift(cx * period.x, cy * period.y, 0);
      for (const V3f& edge : edges) vertices.emplace_back(V3d(edge) + shift);
      for (int p = 0; p < static_cast<int>(hairs.points.size()); ++p) {
        if ((p + 1) % Hairs::points_each == 0) continue;
        // The order that hair_place() reads.
        const int left = first + 2 * p;
        triangles.emplace_back(left, left + 1, left + 2);
        triangles.emplace_back(left + 1, left + 3, left + 2);
      }
    }
  }
  return attach(state, vertices, triangles, pass_hairs);
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
  state->block.period = period;
  state->block.z_low = -1e-3 * size;
  state->block.z_high = thickness + 1e-3 * size;

  // Shifted to the origin by whole periods and down to z = 0 in double precision, as single precision loses
  // the digits of a mesh that is far away.
  const auto whole_periods = [](double low, double length) {
    return std::floor(low / length + 1e-6) * length;
  };
  const V3d shift(whole_periods(state->bounds.min.x, period.x), whole_periods(state->bounds.min.y, period.y),
                  low_z);
  for (V3f& p : state->mesh.positions) p = V3f(V3d(p) - shift);
  for (V3f& p : state->mesh.hairs.points) p = V3f(V3d(p) - shift);
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
  state->block.min = {-block_reach * period.x, -block_reach * period.y};
  state->block.max = {(1 + block_reach) * period.x, (1 + block_reach) * period.y};

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
  if (!attach(*state, vertices, triangles) || !attach_hairs(*state)) {
    return fail(Code::mesh_invalid, name, {}, "not enough memory for the ray tracer");
  }
  rtcCommitScene(state->scene);
  if (rtcGetDeviceError(state->device) != RTC_ERROR_NONE) {
    return fail(Code::mesh_invalid, name, {}, "the ray tracer refuses the mesh");
  }
  RayScene scene(std::move(state));
  scene.state_->open = scene.is_translucent() && shows_backs(scene, 0, true);
  return scene;
}

}  // namespace selvedge
