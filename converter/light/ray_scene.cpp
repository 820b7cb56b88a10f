#include "converter/light/ray_scene.h"

#include <embree3/rtcore.h>
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <vector>

namespace selvedge {

struct RayScene::State {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  Box bounds;  // of one cell, before copies
  CellMesh mesh;
  int ground_triangle = 0;  // the first one
  double z_low = 0;         // the slab outside of which there is nothing, with a margin
  double z_high = 0;
  V2d block_min;  // the block that a ray may cross before it is shifted back
  V2d block_max;
  double offset = 0;  // mm, keeps a ray off the surface that it leaves

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

/// Share of the way through the block after which a ray is shifted back. Less than all: a wall that stands
/// exactly where the block ends then lies ahead of the ray, not under its feet.
constexpr double turn = 1 - 1e-4;

/// A ray within 1e-5 of level could be shifted for ever.
constexpr int max_pieces = 4096;

/// Distance along the ray to where it leaves the interval, or infinity.
template <class Real>
Real leave_interval(Real origin, Real direction, Real low, Real high) {
  const Real distance = ((direction > 0 ? high : low) - origin) / direction;
  return direction == 0 ? std::numeric_limits<Real>::infinity() : distance;
}

double wrap(double value, double period) {
  if (value >= 0 && value < period) return value;
  const double wrapped = value - period * std::floor(value / period);
  return wrapped < period ? wrapped : 0;
}

/// A coordinate on a wall belongs to both cells: made exactly the same number in each, copies close up.
double snap_to_wall(double value, double period) {
  const double turns = value / period;
  const double nearest = std::round(turns);
  return std::abs(turns - nearest) < 1e-6 ? nearest * period : value;
}

/// Two triangles over the cell at z = 0. They count as yarn everywhere but where they are asked for by name.
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

RayScene::RayScene(std::unique_ptr<State> state) : state_(std::move(state)) {}
RayScene::RayScene(RayScene&&) noexcept = default;
RayScene& RayScene::operator=(RayScene&&) noexcept = default;
RayScene::~RayScene() = default;
const Box& RayScene::bounds() const { return state_->bounds; }
V2d RayScene::period() const { return state_->mesh.period; }
const CellMesh& RayScene::mesh() const { return state_->mesh; }
bool RayScene::is_ground(const SurfacePoint& point) const {
  return point.triangle >= state_->ground_triangle;
}

Result<RayScene> RayScene::create(const CellMesh& mesh, const std::string& name,
                                  std::optional<float> ground) {
  auto state = std::make_unique<State>();
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

  // Near the origin by whole periods, and down to z = 0, in double: single precision would swallow the
  // offset of a mesh that lies far away.
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

  // Copies whose triangles may reach into the block although their cell lies outside of it.
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
  state->block_min = {-reach * period.x, -reach * period.y};
  state->block_max = {(1 + reach) * period.x, (1 + reach) * period.y};

  std::vector<V3f> vertices;
  std::vector<V3i> triangles;
  for (int cy = -reach - extra_y; cy <= reach + extra_y; ++cy) {
    for (int cx = -reach - extra_x; cx <= reach + extra_x; ++cx) {
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

/// Moves the origin onto the slab: a ray from far above starts where there may be something. False where the
/// ray never comes to it.
bool onto_slab(double z_low, double z_high, V3d& origin, const V3d& direction) {
  if (origin.z > z_high) {
    if (direction.z >= 0) return false;
    origin += direction * ((z_high - origin.z) / direction.z);
  }
  if (origin.z < z_low) {
    if (direction.z <= 0) return false;
    origin += direction * ((z_low - origin.z) / direction.z);
  }
  return true;
}

/// Walks a ray block by block. `step(origin, far)` looks at one piece and says whether to stop.
template <class State, class Step>
bool walk(const State& s, V3d origin, const V3d& direction, const Step& step) {
  if (!onto_slab(s.z_low, s.z_high, origin, direction)) return false;
  for (int piece = 0; piece < max_pieces; ++piece) {
    origin.x = wrap(origin.x, s.mesh.period.x);
    origin.y = wrap(origin.y, s.mesh.period.y);
    const double out = leave_interval(origin.z, direction.z, s.z_low, s.z_high);
    const double side = std::min(leave_interval(origin.x, direction.x, s.block_min.x, s.block_max.x),
                                 leave_interval(origin.y, direction.y, s.block_min.y, s.block_max.y));
    if (step(origin, std::min(out, side))) return true;
    if (out <= side || side == infinity) return false;
    origin += direction * (turn * side);
  }
  return false;
}

template <class State>
SurfacePoint point_from(const State& s, const V3d& at, const V3d& direction, const V3f& geometric_normal,
                        unsigned primitive, float u, float v) {
  SurfacePoint point;
  point.position = V3f(V3d(wrap(at.x, s.mesh.period.x), wrap(at.y, s.mesh.period.y), at.z));
  point.face_normal = geometric_normal.normalized();
  point.back = point.face_normal.dot(V3f(direction)) > 0;
  if (point.back) point.face_normal = -point.face_normal;
  point.triangle = static_cast<int>(primitive % s.mesh.triangles.size());
  point.u = u;
  point.v = v;
  return point;
}

/// Up to 16 rays on their way.
struct alignas(64) RayPacket {
  std::array<float, packet_size> x, y, z;     // origins, in the block
  std::array<float, packet_size> dx, dy, dz;  // unit directions
};

using PacketLanes = std::array<float, packet_size>;

/// Distances to where each ray leaves the slab, and the sides of the block. Lane by lane: the same for any
/// width of the machine's registers.
__attribute__((target_clones("avx512f", "avx2", "default"))) void leave_block(const RayPacket& p,
                                                                              const V3f& low, const V3f& high,
                                                                              PacketLanes& out,
                                                                              PacketLanes& side,
                                                                              PacketLanes& far) {
  for (std::size_t i = 0; i < packet_size; ++i) {
    out[i] = leave_interval(p.z[i], p.dz[i], low.z, high.z);
    side[i] = std::min(leave_interval(p.x[i], p.dx[i], low.x, high.x),
                       leave_interval(p.y[i], p.dy[i], low.y, high.y));
    far[i] = std::min(out[i], side[i]);
  }
}

/// Walks the rays of a packet block by block. `step(packet, far, active)` looks at one piece of each active
/// ray and gives back those that are done.
template <class State, class Step>
void walk_packet(const State& s, RayPacket& p, std::uint32_t active, const Step& step) {
  const V3f low(V3d(s.block_min.x, s.block_min.y, s.z_low));
  const V3f high(V3d(s.block_max.x, s.block_max.y, s.z_high));
  for (int piece = 0; piece < max_pieces && active != 0; ++piece) {
    alignas(64) PacketLanes out;
    alignas(64) PacketLanes side;
    alignas(64) PacketLanes far;
    leave_block(p, low, high, out, side, far);
    active &= ~step(p, far, active);
    for (std::uint32_t left = active; left != 0; left &= left - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(left));
      if (out[i] <= side[i] || std::isinf(side[i])) {
        active &= ~(1U << i);
        continue;
      }
      const auto move = [&](float origin, float direction, double period) {
        return static_cast<float>(wrap(static_cast<double>(origin) + static_cast<double>(direction) * turn *
                                                                         static_cast<double>(side[i]),
                                       period));
      };
      p.x[i] = move(p.x[i], p.dx[i], s.mesh.period.x);
      p.y[i] = move(p.y[i], p.dy[i], s.mesh.period.y);
      p.z[i] += p.dz[i] * (static_cast<float>(turn) * side[i]);
    }
  }
}

/// Every lane holds a ray, or the tracer would read what nobody wrote: lanes without one repeat the first.
void set_lane(RayPacket& p, std::size_t i, const V3d& origin, const V3d& direction) {
  p.x[i] = static_cast<float>(origin.x);
  p.y[i] = static_cast<float>(origin.y);
  p.z[i] = static_cast<float>(origin.z);
  p.dx[i] = static_cast<float>(direction.x);
  p.dy[i] = static_cast<float>(direction.y);
  p.dz[i] = static_cast<float>(direction.z);
}

void set_rays(RTCRay16& rays, const RayPacket& p, const PacketLanes& far) {
  std::copy(p.x.begin(), p.x.end(), rays.org_x);
  std::copy(p.y.begin(), p.y.end(), rays.org_y);
  std::copy(p.z.begin(), p.z.end(), rays.org_z);
  std::copy(p.dx.begin(), p.dx.end(), rays.dir_x);
  std::copy(p.dy.begin(), p.dy.end(), rays.dir_y);
  std::copy(p.dz.begin(), p.dz.end(), rays.dir_z);
  std::copy(far.begin(), far.end(), rays.tfar);
  std::fill_n(rays.tnear, packet_size, 0.0F);
  std::fill_n(rays.time, packet_size, 0.0F);
  std::fill_n(rays.mask, packet_size, 0xffffffffU);
  std::fill_n(rays.id, packet_size, 0U);
  std::fill_n(rays.flags, packet_size, 0U);
}

struct alignas(64) Valid {
  std::array<int, packet_size> lane;
  explicit Valid(std::uint32_t active) {
    for (std::size_t i = 0; i < packet_size; ++i) lane[i] = (active >> i & 1U) != 0 ? -1 : 0;
  }
};

/// For rays that lie close together the tracer goes through its tree once for all of them.
RTCIntersectContext coherent_context() {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}

template <class State>
std::uint32_t trace_packet(const State& s, RayPacket& packet, std::uint32_t active,
                           std::span<const V3d> directions, PointPacket& points) {
  std::uint32_t met = 0;
  walk_packet(s, packet, active, [&](const RayPacket& p, const PacketLanes& far, std::uint32_t now) {
    RTCRayHit16 query;
    set_rays(query.ray, p, far);
    std::fill_n(query.hit.geomID, packet_size, RTC_INVALID_GEOMETRY_ID);
    std::fill_n(query.hit.instID[0], packet_size, RTC_INVALID_GEOMETRY_ID);
    RTCIntersectContext context = coherent_context();
    const Valid valid(now);
    rtcIntersect16(valid.lane.data(), s.scene, &context, &query);
    std::uint32_t done = 0;
    for (std::uint32_t left = now; left != 0; left &= left - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(left));
      if (query.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
      done |= 1U << i;
      const V3d& direction = directions[directions.size() == 1 ? 0 : i];
      const V3d at = V3d(p.x[i], p.y[i], p.z[i]) + direction * static_cast<double>(query.ray.tfar[i]);
      points[i] = point_from(s, at, direction, V3f(query.hit.Ng_x[i], query.hit.Ng_y[i], query.hit.Ng_z[i]),
                             query.hit.primID[i], query.hit.u[i], query.hit.v[i]);
    }
    met |= done;
    return done;
  });
  return met;
}

template <class State>
std::uint32_t occluded_packet(const State& s, RayPacket& packet, std::uint32_t active) {
  std::uint32_t blocked = 0;
  walk_packet(s, packet, active, [&](const RayPacket& p, const PacketLanes& far, std::uint32_t now) {
    RTCRay16 rays;
    set_rays(rays, p, far);
    RTCIntersectContext context = coherent_context();
    const Valid valid(now);
    rtcOccluded16(valid.lane.data(), s.scene, &context, &rays);
    std::uint32_t done = 0;
    for (std::size_t i = 0; i < packet_size; ++i) {
      done |= (rays.tfar[i] < 0 ? 1U : 0U) << i;
    }
    done &= now;
    blocked |= done;
    return done;
  });
  return blocked;
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
    point = point_from(s, at, direction, V3f(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z),
                       query.hit.primID, query.hit.u, query.hit.v);
    return true;
  });
}

std::uint32_t RayScene::trace(std::span<const V3d> origins, const V3d& direction, PointPacket& points) const {
  const State& s = *state_;
  RayPacket packet{};
  std::uint32_t active = 0;
  for (std::size_t i = 0; i < packet_size; ++i) {
    V3d origin = origins[i < origins.size() ? i : 0];
    if (onto_slab(s.z_low, s.z_high, origin, direction) && i < origins.size()) active |= 1U << i;
    origin.x = wrap(origin.x, s.mesh.period.x);
    origin.y = wrap(origin.y, s.mesh.period.y);
    set_lane(packet, i, origin, direction);
  }
  return trace_packet(s, packet, active, {&direction, 1}, points);
}

std::uint32_t RayScene::trace(const V3d& origin, std::span<const V3d> directions, PointPacket& points) const {
  const State& s = *state_;
  RayPacket packet{};
  std::uint32_t active = 0;
  for (std::size_t i = 0; i < packet_size; ++i) {
    const V3d& direction = directions[i < directions.size() ? i : 0];
    V3d from = origin;
    if (onto_slab(s.z_low, s.z_high, from, direction) && i < directions.size()) active |= 1U << i;
    from.x = wrap(from.x, s.mesh.period.x);
    from.y = wrap(from.y, s.mesh.period.y);
    set_lane(packet, i, from, direction);
  }
  return trace_packet(s, packet, active, directions, points);
}

V3d RayScene::leave(const SurfacePoint& point) const {
  return V3d(point.position) + V3d(point.face_normal) * state_->offset;
}

V3f RayScene::vertex_normal(const SurfacePoint& point) const {
  // Not turned towards the ray one by one: at a silhouette the smooth normal may lean away a little.
  const V3f smooth = interpolate(mesh().normals, point).normalized();
  return smooth.dot(point.face_normal) < 0 ? -smooth : smooth;
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

LeavingPacket RayScene::leave(const PointPacket& points, std::uint32_t active) const {
  const auto first = static_cast<std::size_t>(std::countr_zero(active));
  LeavingPacket packet;
  for (std::size_t i = 0; i < packet_size; ++i) {
    const V3d origin = leave(points[(active >> i & 1U) != 0 ? i : first]);
    packet.x[i] = static_cast<float>(origin.x);
    packet.y[i] = static_cast<float>(origin.y);
    packet.z[i] = static_cast<float>(origin.z);
  }
  return packet;
}

std::uint32_t RayScene::occluded(const LeavingPacket& points, const V3f& direction,
                                 std::uint32_t active) const {
  if (active == 0) return 0;
  RayPacket packet{points.x, points.y, points.z, {}, {}, {}};
  packet.dx.fill(direction.x);
  packet.dy.fill(direction.y);
  packet.dz.fill(direction.z);
  return occluded_packet(*state_, packet, active);
}

std::uint32_t RayScene::occluded(const SurfacePoint& point, std::span<const V3f> directions,
                                 std::uint32_t active) const {
  if (active == 0) return 0;
  const V3d origin = leave(point);
  RayPacket packet{};
  for (std::size_t i = 0; i < packet_size; ++i) {
    set_lane(packet, i, origin, V3d(directions[i < directions.size() ? i : 0]));
  }
  return occluded_packet(*state_, packet, active);
}

}  // namespace selvedge
