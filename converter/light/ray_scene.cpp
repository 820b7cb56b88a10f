#include "converter/light/ray_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "converter/light/cell_walk.h"
#include "format/base/random.h"

namespace selvedge {

struct RaySceneState {
  RaySceneState() = default;
  RaySceneState& operator=(RaySceneState&&) = delete;
  ~RaySceneState() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }

  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  Imath::Box3f bounds;  // of one cell
  CellMesh mesh;
  std::vector<int> triangle_of;    // the mesh's, of each in the scene
  std::vector<int> hair_point_of;  // the first point of each piece of a hair; two triangles make a piece
  CellBlock block;
  double offset = 0;  // offset of rays from the surface that they leave
};

namespace {

/// Cells on each side of the middle one that a ray crosses before it is shifted back. More cost memory, fewer
/// cost restarts; one suffices for most rays in a cell that is thinner than wide.
constexpr int block_reach = 1;
/// Cells of more triangles have parts of others around them alone, this many
/// thicknesses of the cell wide.
constexpr std::size_t few_triangles = 100000;
constexpr double thicknesses_around = 2;

/// The scene's second geometry; the first one holds the triangles.
constexpr unsigned hair_geometry = 1;

/// A point on the ribbon of a hair, `side` (-1 to 1) of the way to its edges, has the normal of a round hair
/// that the ray meets there.
void place_on_hair(const RaySceneState& s, unsigned primitive, float side, SurfacePoint& point) {
  const Hairs& hairs = s.mesh.hairs;
  point.is_back = false;
  point.hair_point = s.hair_point_of[primitive / 2];
  point.triangle = hairs.root_triangles[point.hair_point / Hairs::points_per_hair];
  point.u = point.v = 1.0F / 3;
  const V3f along = (hairs.points[point.hair_point + 1] - hairs.points[point.hair_point]).normalized();
  const V3f across = point.view.cross(along).normalized();
  const V3f front = along.cross(across);
  point.face_normal = front * std::sqrt(std::max(0.0F, 1 - side * side)) + across * side;
  if (point.face_normal.length2() < 0.5F) point.face_normal = point.view;  // seen along itself
}

SurfacePoint point_from(const RaySceneState& s, const V3d& position, const V3d& direction,
                        const V3f& geometric_normal, unsigned geometry, unsigned primitive, float u,
                        float v) {
  SurfacePoint point{.position = V3f(V3d(wrap_to_repeat(position.x, s.block.period.x),
                                         wrap_to_repeat(position.y, s.block.period.y), position.z)),
                     .face_normal = geometric_normal.normalized(),
                     .view = V3f(-direction)};
  point.is_back = point.face_normal.dot(V3f(direction)) > 0;
  if (point.is_back) point.face_normal = -point.face_normal;
  if (geometry == hair_geometry) {
    place_on_hair(s, primitive, primitive % 2 == 0 ? 2 * u - 1 : 1 - 2 * v, point);
    return point;
  }
  point.triangle = s.triangle_of[primitive];
  point.u = u;
  point.v = v;
  return point;
}

/// Snaps coordinates on a wall to the same number in both cells, so that copies meet without gaps.
double snap_to_wall(double value, double period) {
  const double turns = value / period;
  const double nearest = std::round(turns);
  return std::abs(turns - nearest) < 1e-6 ? nearest * period : value;
}

/// Whether the box of some points meets the block, seen from above.
bool meet(std::initializer_list<V3d> points, const CellBlock& block) {
  Imath::Box3d box;
  for (const V3d& point : points) box.extendBy(point);
  return box.min.x <= block.max.x && box.max.x >= block.min.x && box.min.y <= block.max.y &&
         box.max.y >= block.min.y;
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
    std::ranges::copy(vertices, static_cast<V3f*>(vertex_buffer));
    std::ranges::copy(triangles, static_cast<V3i*>(index_buffer));
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

/// Rays that begin on a hair do not meet it again: hairs nearer than this, in their radii, are passed.
constexpr float near_radii = 4;

/// Lets the fraction `passed` of rays go on, by a number that belongs to the ray and the hair.
void pass_hairs(const RTCFilterFunctionNArguments* args) {
  const auto& state = *static_cast<const RaySceneState*>(args->geometryUserPtr);
  const Hairs& hairs = state.mesh.hairs;
  const unsigned n = args->N;
  for (unsigned i = 0; i < n; ++i) {
    if (args->valid[i] != -1) continue;
    const int hair = state.hair_point_of[RTCHitN_primID(args->hit, n, i) / 2] / Hairs::points_per_hair;
    const auto bits = [](float x) { return static_cast<std::uint64_t>(std::bit_cast<std::uint32_t>(x)); };
    RTCRayN* const ray = args->ray;
    const std::uint64_t origin = bits(RTCRayN_org_x(ray, n, i)) << 32U ^ bits(RTCRayN_org_y(ray, n, i));
    const std::uint64_t direction = bits(RTCRayN_dir_x(ray, n, i)) << 32U ^ bits(RTCRayN_dir_y(ray, n, i));
    const std::uint64_t drawn = hash64(hash64(origin ^ hash64(direction)) ^ static_cast<std::uint64_t>(hair));
    const bool near = RTCRayN_tfar(ray, n, i) < near_radii * hairs.radius[hair];
    if (near || static_cast<float>(drawn >> 40U) * 0x1.0p-24F < hairs.transparency[hair]) args->valid[i] = 0;
  }
}

/// Both edges of a hair's ribbon at each of its points: it turns about itself by half a turn. Seen from
/// anywhere, a ribbon of width pi r then covers 2 r on average, as a round hair does.
void add_edges(const Hairs& hairs, std::size_t hair, std::vector<V3f>& edges) {
  const V3f* const points = &hairs.points[hair * Hairs::points_per_hair];
  const double half_width = 0.5 * std::numbers::pi * static_cast<double>(hairs.radius[hair]);
  V3d across(0, 0, 0);
  for (int k = 0; k < Hairs::points_per_hair; ++k) {
    const int next = std::min(k + 1, Hairs::points_per_hair - 1);
    V3d along(points[next] - points[next - 1]);
    along = along.length() > 0 ? along.normalized() : V3d(1, 0, 0);
    if (k == 0) across = along.cross(std::abs(along.z) < 0.9 ? V3d(0, 0, 1) : V3d(1, 0, 0));
    across = (across - along * across.dot(along)).normalized();
    const double turn = std::numbers::pi * k / (Hairs::points_per_hair - 1);
    const V3d edge = (across * std::cos(turn) + along.cross(across) * std::sin(turn)) * half_width;
    edges.emplace_back(V3d(points[k]) - edge);
    edges.emplace_back(V3d(points[k]) + edge);
  }
}

/// Adds the triangles of all cells that reach into the block, from up to `extra` cells beyond it.
void fill_block(RaySceneState& state, int extra_x, int extra_y, std::vector<V3f>& vertices,
                std::vector<V3i>& triangles) {
  const V2d period = state.mesh.period;
  for (int cy = -block_reach - extra_y; cy <= block_reach + extra_y; ++cy) {
    for (int cx = -block_reach - extra_x; cx <= block_reach + extra_x; ++cx) {
      const V3d to(cx * period.x, cy * period.y, 0);
      if (!meet({V3d(state.bounds.min) + to, V3d(state.bounds.max) + to}, state.block)) continue;
      std::vector<int> copies(state.mesh.positions.size(), -1);
      const auto at = [&](int vertex) {
        const V3d p(state.mesh.positions[vertex]);
        return V3d(snap_to_wall(p.x + cx * period.x, period.x), snap_to_wall(p.y + cy * period.y, period.y),
                   p.z);
      };
      for (std::size_t t = 0; t < state.mesh.triangles.size(); ++t) {
        V3i corner = state.mesh.triangles[t];
        if (!meet({at(corner.x), at(corner.y), at(corner.z)}, state.block)) continue;
        for (int k = 0; k < 3; ++k) {
          int& copy = copies[corner[k]];
          if (copy < 0) {
            copy = static_cast<int>(vertices.size());
            vertices.emplace_back(at(corner[k]));
          }
          corner[k] = copy;
        }
        triangles.push_back(corner);
        state.triangle_of.push_back(static_cast<int>(t));
      }
    }
  }
}

/// The hairs of all cells that reach into the block; true without any.
bool attach_hairs(RaySceneState& state) {
  const Hairs& hairs = state.mesh.hairs;
  if (hairs.root_triangles.empty()) return true;
  const V2d period = state.mesh.period;
  V2d low(0, 0);
  V2d high(period);
  for (std::size_t k = 0; k < hairs.points.size(); ++k) {
    const V3d p(hairs.points[k]);
    for (int i = 0; i < 2; ++i) {
      low[i] = std::min(low[i], p[i]);
      high[i] = std::max(high[i], p[i]);
    }
    // Rays begin where they enter the slab: further from a hair than the passed distance.
    const auto clear = static_cast<double>(2 * near_radii * hairs.radius[k / Hairs::points_per_hair]);
    state.block.z_low = std::min(state.block.z_low, p.z - clear);
    state.block.z_high = std::max(state.block.z_high, p.z + clear);
  }
  std::vector<V3f> edges;
  for (std::size_t h = 0; h < hairs.root_triangles.size(); ++h) add_edges(hairs, h, edges);
  const auto cells = [](double overhang, double length) {
    return block_reach + static_cast<int>(std::ceil(overhang / length));
  };
  std::vector<V3f> vertices;
  std::vector<V3i> triangles;
  for (int cy = -cells(high.y - period.y, period.y); cy <= cells(-low.y, period.y); ++cy) {
    for (int cx = -cells(high.x - period.x, period.x); cx <= cells(-low.x, period.x); ++cx) {
      const V3d shift(cx * period.x, cy * period.y, 0);
      for (int p = 0; p < static_cast<int>(hairs.points.size()); ++p) {
        if ((p + 1) % Hairs::points_per_hair == 0) continue;
        const auto at = [&](int edge) { return V3d(edges[2 * p + edge]) + shift; };
        if (!meet({at(0), at(1), at(2), at(3)}, state.block)) continue;
        // The order that place_on_hair() reads.
        const int left = static_cast<int>(vertices.size());
        for (int edge = 0; edge < 4; ++edge) vertices.emplace_back(at(edge));
        triangles.emplace_back(left, left + 1, left + 2);
        triangles.emplace_back(left + 1, left + 3, left + 2);
        state.hair_point_of.push_back(p);
      }
    }
  }
  return attach(state, vertices, triangles, pass_hairs);
}

}  // namespace

const Imath::Box3f& RayScene::bounds() const { return state_->bounds; }
V2d RayScene::period() const { return state_->mesh.period; }
const CellMesh& RayScene::mesh() const { return state_->mesh; }

bool RayScene::trace(const V3d& origin, const V3d& direction, SurfacePoint& point) const {
  const RaySceneState& s = *state_;
  return walk_blocks(s.block, origin, direction, [&](const V3d& start, double far) {
    RTCRayHit query{};
    query.ray = ray_from(start, direction, far);
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(s.scene, &context, &query);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
    const V3d position = start + direction * static_cast<double>(query.ray.tfar);
    point = point_from(s, position, direction, V3f(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z),
                       query.hit.geomID, query.hit.primID, query.hit.u, query.hit.v);
    return true;
  });
}

V3d RayScene::offset_origin(const SurfacePoint& point) const {
  return V3d(point.position) + V3d(point.face_normal) * state_->offset;
}

V3f RayScene::vertex_normal(const SurfacePoint& point) const {
  if (point.hair_point >= 0) return point.face_normal;
  // Not flipped towards the ray per vertex: at a silhouette the smooth normal may lean away slightly.
  const V3f smooth = interpolate(mesh().normals, point).normalized();
  return smooth.dot(point.face_normal) < 0 ? -smooth : smooth;
}

bool RayScene::is_occluded(const SurfacePoint& point, const V3f& direction) const {
  const RaySceneState& s = *state_;
  const V3d towards(direction);
  return walk_blocks(s.block, offset_origin(point), towards, [&](const V3d& start, double far) {
    RTCRay ray = ray_from(start, towards, far);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(s.scene, &context, &ray);
    return ray.tfar < 0;
  });
}

Result<RayScene> RayScene::create(const CellMesh& mesh, const std::string& name) {
  auto state = std::make_shared<RaySceneState>();
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

  // Cells outside of the block whose triangles may reach into it.
  const auto overhang = [](double high, double length) {
    return static_cast<int>(std::ceil(std::max(0.0, high / length - 1) - 1e-6));
  };
  const int extra_x = overhang(state->bounds.max.x, period.x);
  const int extra_y = overhang(state->bounds.max.y, period.y);
  constexpr int max_extra = 8;
  if (extra_x > max_extra || extra_y > max_extra)
    return fail(Code::mesh_invalid, name, "period",
                fmt::format("the mesh reaches {} periods beyond its cell; {} are allowed",
                            std::max(extra_x, extra_y), max_extra));
  for (int i = 0; i < 2; ++i) {
    const bool few = mesh.triangles.size() <= few_triangles;
    const double around = std::min(block_reach * period[i], few ? size : thicknesses_around * thickness);
    state->block.min[i] = -around;
    state->block.max[i] = period[i] + around;
  }

  std::vector<V3f> vertices;
  std::vector<V3i> triangles;
  fill_block(*state, extra_x, extra_y, vertices, triangles);
  if (triangles.empty()) return fail(Code::mesh_empty, name, {}, "the mesh has no triangles");

  state->device = rtcNewDevice(nullptr);
  if (state->device == nullptr) return fail(Code::mesh_invalid, name, {}, "the ray tracer cannot be started");
  state->scene = rtcNewScene(state->device);
  rtcSetSceneFlags(state->scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(state->scene, RTC_BUILD_QUALITY_HIGH);
  if (!attach(*state, vertices, triangles) || !attach_hairs(*state))
    return fail(Code::mesh_invalid, name, {}, "not enough memory for the ray tracer");
  rtcCommitScene(state->scene);
  if (rtcGetDeviceError(state->device) != RTC_ERROR_NONE)
    return fail(Code::mesh_invalid, name, {}, "the ray tracer refuses the mesh");
  return RayScene(std::move(state));
}

}  // namespace selvedge
