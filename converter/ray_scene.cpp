#include "converter/ray_scene.h"

#include <embree3/rtcore.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace selvedge {

struct RayScene::State {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  Box bounds;  // of one cell, before copies
  V2d period;
  double z_low = 0;  // the slab outside of which there is nothing, with a margin
  double z_high = 0;
  V2d block_min;  // the block that a ray may cross before it is shifted back
  V2d block_max;
  double offset = 0;  // mm, keeps a ray off the surface that it leaves
  std::vector<V3f> vertex_normals;
  std::vector<V3f> albedo;
  std::vector<V3i> triangles;

  ~State() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }
};

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Cells on each side of the middle one that a ray crosses before it is shifted back: more cost memory, fewer
/// cost restarts. One is enough for most rays of a cell that is thinner than wide.
constexpr int reach = 1;

/// Distance along the ray to where it leaves the interval, or infinity.
double leave_interval(double origin, double direction, double low, double high) {
  if (direction > 0) return (high - origin) / direction;
  if (direction < 0) return (low - origin) / direction;
  return infinity;
}

double wrap(double value, double period) {
  const double wrapped = value - period * std::floor(value / period);
  return wrapped < period ? wrapped : 0;
}

/// A coordinate on a wall belongs to both cells: made exactly the same number in each, copies close up.
double snap_to_wall(double value, double period) {
  const double turns = value / period;
  const double nearest = std::round(turns);
  return std::abs(turns - nearest) < 1e-6 ? nearest * period : value;
}

}  // namespace

RayScene::RayScene(std::unique_ptr<State> state) : state_(std::move(state)) {}
RayScene::RayScene(RayScene&&) noexcept = default;
RayScene& RayScene::operator=(RayScene&&) noexcept = default;
RayScene::~RayScene() = default;
const Box& RayScene::bounds() const { return state_->bounds; }
V2d RayScene::period() const { return state_->period; }

Result<RayScene> RayScene::create(const CellMesh& mesh, const std::string& name) {
  auto state = std::make_unique<State>();
  state->bounds = bounds_of(mesh);
  state->period = mesh.period;
  state->vertex_normals = mesh.normals;
  state->albedo = mesh.albedo;
  state->triangles = mesh.triangles;

  // Down to z = 0, in double: single precision would swallow the offset of a mesh that lies far up.
  const double low_z = static_cast<double>(state->bounds.min.z);
  const double thickness = static_cast<double>(state->bounds.max.z) - low_z;
  state->bounds.min.z = 0;
  state->bounds.max.z = static_cast<float>(thickness);

  const double size = std::max(mesh.period.x, mesh.period.y);
  state->offset =
      std::max(2e-5 * size, 8 * static_cast<double>(std::numeric_limits<float>::epsilon()) * thickness);
  state->z_low = state->bounds.min.z - 1e-3 * size;
  state->z_high = state->bounds.max.z + 1e-3 * size;

  // Copies whose triangles may reach into the block although their cell lies outside of it.
  // A mesh far from the origin is moved by whole periods first.
  const auto whole_periods = [](double low, double period) {
    return std::floor(low / period + 1e-6) * period;
  };
  const V2d shift(whole_periods(state->bounds.min.x, mesh.period.x),
                  whole_periods(state->bounds.min.y, mesh.period.y));
  const auto overhang = [](double high, double period) {
    return static_cast<int>(std::ceil(std::max(0.0, high / period - 1) - 1e-6));
  };
  const int extra_x = overhang(state->bounds.max.x - shift.x, mesh.period.x);
  const int extra_y = overhang(state->bounds.max.y - shift.y, mesh.period.y);
  constexpr int most_extra = 8;
  if (extra_x > most_extra || extra_y > most_extra) {
    return fail(Code::mesh_invalid, name, "period",
                fmt::format("the mesh reaches {} periods beyond its cell; {} are allowed",
                            std::max(extra_x, extra_y), most_extra));
  }
  state->block_min = {-reach * mesh.period.x, -reach * mesh.period.y};
  state->block_max = {(1 + reach) * mesh.period.x, (1 + reach) * mesh.period.y};

  std::vector<V3f> vertices;
  std::vector<V3i> triangles;
  const auto per_copy = static_cast<int>(mesh.positions.size());
  for (int cy = -reach - extra_y; cy <= reach + extra_y; ++cy) {
    for (int cx = -reach - extra_x; cx <= reach + extra_x; ++cx) {
      const int first = static_cast<int>(vertices.size());
      for (const V3f& p : mesh.positions) {
        vertices.emplace_back(
            V3f(V3d(snap_to_wall(p.x - shift.x + cx * mesh.period.x, mesh.period.x),
                    snap_to_wall(p.y - shift.y + cy * mesh.period.y, mesh.period.y), p.z - low_z)));
      }
      for (const V3i& t : mesh.triangles) triangles.push_back(t + V3i(first));
    }
  }
  if (static_cast<std::size_t>(per_copy) * triangles.size() == 0) {
    return fail(Code::mesh_empty, name, {}, "the mesh has no triangles");
  }

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

namespace {

RTCRay ray_from(const V3d& origin, const V3d& direction, double far) {
  RTCRay ray{};
  ray.org_x = static_cast<float>(origin.x);
  ray.org_y = static_cast<float>(origin.y);
  ray.org_z = static_cast<float>(origin.z);
  ray.dir_x = static_cast<float>(direction.x);
  ray.dir_y = static_cast<float>(direction.y);
  ray.dir_z = static_cast<float>(direction.z);
  ray.tnear = 0;
  ray.tfar = static_cast<float>(far);
  ray.mask = 0xffffffffU;
  return ray;
}

/// Walks a ray block by block. `step(origin, far)` looks at one piece and says whether to stop.
template <class State, class Step>
bool walk(const State& s, V3d origin, const V3d& direction, const Step& step) {
  // Onto the slab first: a ray from far above starts where there may be something.
  if (origin.z > s.z_high) {
    if (direction.z >= 0) return false;
    origin += direction * ((s.z_high - origin.z) / direction.z);
  }
  if (origin.z < s.z_low) {
    if (direction.z <= 0) return false;
    origin += direction * ((s.z_low - origin.z) / direction.z);
  }
  // A ray within 1e-5 of level could be shifted for ever.
  constexpr int most_pieces = 4096;
  for (int piece = 0; piece < most_pieces; ++piece) {
    origin.x = wrap(origin.x, s.period.x);
    origin.y = wrap(origin.y, s.period.y);
    const double out = leave_interval(origin.z, direction.z, s.z_low, s.z_high);
    const double side = std::min(leave_interval(origin.x, direction.x, s.block_min.x, s.block_max.x),
                                 leave_interval(origin.y, direction.y, s.block_min.y, s.block_max.y));
    if (step(origin, std::min(out, side))) return true;
    if (out <= side || side == infinity) return false;
    origin += direction * side;
  }
  return false;
}

}  // namespace

bool RayScene::trace(const V3d& origin, const V3d& direction, SurfacePoint& point) const {
  const State& s = *state_;
  return walk(s, origin, direction, [&](const V3d& from, double far) {
    RTCRayHit query{};
    query.ray = ray_from(from, direction, far);
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(s.scene, &context, &query);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;

    const V3d at = from + direction * static_cast<double>(query.ray.tfar);
    const std::size_t triangle = query.hit.primID % s.triangles.size();
    const V3i& corner = s.triangles[triangle];
    const float u = query.hit.u;
    const float v = query.hit.v;
    const auto mix3 = [&](const std::vector<V3f>& values) {
      return values[static_cast<std::size_t>(corner.x)] * (1 - u - v) +
             values[static_cast<std::size_t>(corner.y)] * u + values[static_cast<std::size_t>(corner.z)] * v;
    };
    const V3f back = -V3f(direction);
    const auto towards = [&](V3f n) {
      n.normalize();
      return n.dot(back) < 0 ? -n : n;
    };
    point.position = V3f(V3d(wrap(at.x, s.period.x), wrap(at.y, s.period.y), at.z));
    point.face_normal = towards(V3f(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z));
    // Not turned towards the ray one by one: at a silhouette the smooth normal may lean away a little.
    V3f smooth = mix3(s.vertex_normals).normalized();
    point.vertex_normal = smooth.dot(point.face_normal) < 0 ? -smooth : smooth;
    point.albedo = mix3(s.albedo);
    return true;
  });
}

V3d RayScene::leave(const SurfacePoint& point) const {
  return V3d(point.position) + V3d(point.face_normal) * state_->offset;
}

bool RayScene::occluded(const SurfacePoint& point, const V3f& direction) const {
  const State& s = *state_;
  const V3d towards(direction);
  return walk(s, leave(point), towards, [&](const V3d& from, double far) {
    RTCRay ray = ray_from(from, towards, far);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(s.scene, &context, &ray);
    return ray.tfar < 0;
  });
}

}  // namespace selvedge
