#include <algorithm>
#include <bit>
#include <cmath>

#include "converter/light/ray_scene_state.h"
#include "format/simd/wide.h"

namespace selvedge {
namespace {

/// A point on the ribbon of a hair, `side` (-1 to 1) of the way to its edges, has the normal of a round hair
/// that the ray meets there.
void place_on_hair(const Hairs& hairs, unsigned primitive, float side, SurfacePoint& point) {
  point.back = false;
  point.hair = hair_point_of(hairs, primitive);
  point.triangle = hairs.roots[point.hair / Hairs::points_each];
  point.u = point.v = 1.0F / 3;
  const V3f along = (hairs.points[point.hair + 1] - hairs.points[point.hair]).normalized();
  const V3f across = point.view.cross(along).normalized();
  const V3f front = along.cross(across);
  point.face_normal = front * std::sqrt(std::max(0.0F, 1 - side * side)) + across * side;
  if (point.face_normal.length2() < 0.5F) point.face_normal = point.view;  // seen along itself
}

SurfacePoint point_from(const RaySceneState& s, const V3d& position, const V3d& direction,
                        const V3f& geometric_normal, unsigned geometry, unsigned primitive, float u,
                        float v) {
  SurfacePoint point;
  point.position =
      V3f(V3d(wrap_into(position.x, s.block.period.x), wrap_into(position.y, s.block.period.y), position.z));
  point.face_normal = geometric_normal.normalized();
  point.view = V3f(-direction);
  point.back = point.face_normal.dot(V3f(direction)) > 0;
  if (point.back) point.face_normal = -point.face_normal;
  if (geometry == hair_geometry) {
    place_on_hair(s.mesh.hairs, primitive, primitive % 2 == 0 ? 2 * u - 1 : 1 - 2 * v, point);
    return point;
  }
  point.triangle = static_cast<int>(primitive % s.mesh.triangles.size());
  point.u = u;
  point.v = v;
  return point;
}

/// Up to 16 rays while they are traced.
struct alignas(64) RayPacket {
  std::array<float, packet_size> x, y, z;     // origins, in the block
  std::array<float, packet_size> dx, dy, dz;  // unit directions
};

using PacketLanes = std::array<float, packet_size>;

/// Distances at which each ray leaves the slab and the block. Lane by lane, so the result does not depend on
/// the width of vector registers.
SELVEDGE_WIDE void leave_block(const RayPacket& p, const V3f& low, const V3f& high, PacketLanes& out,
                               PacketLanes& side, PacketLanes& far) {
  for (std::size_t i = 0; i < packet_size; ++i) {
    out[i] = leave_interval(p.z[i], p.dz[i], low.z, high.z);
    side[i] = std::min(leave_interval(p.x[i], p.dx[i], low.x, high.x),
                       leave_interval(p.y[i], p.dy[i], low.y, high.y));
    far[i] = std::min(out[i], side[i]);
  }
}

/// Walks the rays of a packet block by block. `step(packet, far, active)` traces one piece of each active ray
/// and returns the rays that are finished.
template <class Step>
void walk_packet(const RaySceneState& s, RayPacket& p, std::uint32_t active, const Step& step) {
  const V3f low(V3d(s.block.min.x, s.block.min.y, s.block.z_low));
  const V3f high(V3d(s.block.max.x, s.block.max.y, s.block.z_high));
  for (int piece = 0; piece < max_block_pieces && active != 0; ++piece) {
    alignas(64) PacketLanes out;
    alignas(64) PacketLanes side;
    alignas(64) PacketLanes far;
    leave_block(p, low, high, out, side, far);
    active &= ~step(p, far, active);
    for (std::uint32_t remaining = active; remaining != 0; remaining &= remaining - 1) {
      const int i = std::countr_zero(remaining);
      if (out[i] <= side[i] || std::isinf(side[i])) {
        active &= ~(1U << i);
        continue;
      }
      const auto move = [&](float origin, float direction, double period) {
        return static_cast<float>(
            wrap_into(static_cast<double>(origin) +
                          static_cast<double>(direction) * block_turn * static_cast<double>(side[i]),
                      period));
      };
      p.x[i] = move(p.x[i], p.dx[i], s.block.period.x);
      p.y[i] = move(p.y[i], p.dy[i], s.block.period.y);
      p.z[i] += p.dz[i] * (static_cast<float>(block_turn) * side[i]);
    }
  }
}

/// Fills unused lanes with the first ray: Embree reads all lanes.
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

/// Coherent rays share one traversal of Embree's tree.
RTCIntersectContext coherent_context() {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}

std::uint32_t trace_packet(const RaySceneState& s, RayPacket& packet, std::uint32_t active,
                           std::span<const V3d> directions, PointPacket& points) {
  std::uint32_t met = 0;
  walk_packet(s, packet, active, [&](const RayPacket& p, const PacketLanes& far, std::uint32_t lanes) {
    RTCRayHit16 query;
    set_rays(query.ray, p, far);
    std::fill_n(query.hit.geomID, packet_size, RTC_INVALID_GEOMETRY_ID);
    std::fill_n(query.hit.instID[0], packet_size, RTC_INVALID_GEOMETRY_ID);
    RTCIntersectContext context = coherent_context();
    const Valid valid(lanes);
    rtcIntersect16(valid.lane.data(), s.scene, &context, &query);
    std::uint32_t done = 0;
    for (std::uint32_t remaining = lanes; remaining != 0; remaining &= remaining - 1) {
      const int i = std::countr_zero(remaining);
      if (query.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
      done |= 1U << i;
      const V3d& direction = directions[directions.size() == 1 ? 0 : i];
      const V3d position = V3d(p.x[i], p.y[i], p.z[i]) + direction * static_cast<double>(query.ray.tfar[i]);
      points[i] =
          point_from(s, position, direction, V3f(query.hit.Ng_x[i], query.hit.Ng_y[i], query.hit.Ng_z[i]),
                     query.hit.geomID[i], query.hit.primID[i], query.hit.u[i], query.hit.v[i]);
    }
    met |= done;
    return done;
  });
  return met;
}

/// The number of rays is that of origins or of directions; a single one of either is shared by all rays.
std::uint32_t trace_rays(const RaySceneState& s, std::span<const V3d> origins,
                         std::span<const V3d> directions, PointPacket& points) {
  const std::size_t count = std::max(origins.size(), directions.size());
  RayPacket packet{};
  std::uint32_t active = 0;
  for (std::size_t i = 0; i < packet_size; ++i) {
    const std::size_t ray = i < count ? i : 0;
    const V3d& direction = directions[directions.size() == 1 ? 0 : ray];
    V3d origin = origins[origins.size() == 1 ? 0 : ray];
    if (onto_slab(s.block, origin, direction) && i < count) active |= 1U << i;
    origin.x = wrap_into(origin.x, s.block.period.x);
    origin.y = wrap_into(origin.y, s.block.period.y);
    set_lane(packet, i, origin, direction);
  }
  return trace_packet(s, packet, active, directions, points);
}

std::uint32_t occluded_packet(const RaySceneState& s, RayPacket& packet, std::uint32_t active) {
  std::uint32_t blocked = 0;
  walk_packet(s, packet, active, [&](const RayPacket& p, const PacketLanes& far, std::uint32_t lanes) {
    RTCRay16 rays;
    set_rays(rays, p, far);
    RTCIntersectContext context = coherent_context();
    const Valid valid(lanes);
    rtcOccluded16(valid.lane.data(), s.scene, &context, &rays);
    std::uint32_t done = 0;
    for (std::size_t i = 0; i < packet_size; ++i) {
      done |= (rays.tfar[i] < 0 ? 1U : 0U) << i;
    }
    done &= lanes;
    blocked |= done;
    return done;
  });
  return blocked;
}

}  // namespace

RayScene::RayScene(std::unique_ptr<RaySceneState> state) : state_(std::move(state)) {}
RayScene::RayScene(RayScene&&) noexcept = default;
RayScene& RayScene::operator=(RayScene&&) noexcept = default;
RayScene::~RayScene() = default;
const Box& RayScene::bounds() const { return state_->bounds; }
V2d RayScene::period() const { return state_->mesh.period; }
const CellMesh& RayScene::mesh() const { return state_->mesh; }
bool RayScene::is_ground(const SurfacePoint& point) const {
  return point.triangle >= state_->ground_triangle;
}

bool RayScene::is_open() const { return state_->open; }

bool RayScene::trace(const V3d& origin, const V3d& direction, SurfacePoint& point) const {
  const RaySceneState& s = *state_;
  return walk(s.block, origin, direction, [&](const V3d& start, double far) {
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

std::uint32_t RayScene::trace(std::span<const V3d> origins, const V3d& direction, PointPacket& points) const {
  return trace_rays(*state_, origins, {&direction, 1}, points);
}

std::uint32_t RayScene::trace(const V3d& origin, std::span<const V3d> directions, PointPacket& points) const {
  return trace_rays(*state_, {&origin, 1}, directions, points);
}

V3d RayScene::leave(const SurfacePoint& point) const {
  return V3d(point.position) + V3d(point.face_normal) * state_->offset;
}

V3f RayScene::vertex_normal(const SurfacePoint& point) const {
  if (point.hair >= 0) return point.face_normal;
  // Not flipped towards the ray per vertex: at a silhouette the smooth normal may lean away slightly.
  const V3f smooth = interpolate(mesh().normals, point).normalized();
  return smooth.dot(point.face_normal) < 0 ? -smooth : smooth;
}

bool RayScene::occluded(const SurfacePoint& point, const V3f& direction) const {
  const RaySceneState& s = *state_;
  const V3d towards(direction);
  return walk(s.block, leave(point), towards, [&](const V3d& start, double far) {
    RTCRay ray = ray_from(start, towards, far);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(s.scene, &context, &ray);
    return ray.tfar < 0;
  });
}

LeavingPacket RayScene::leave(const PointPacket& points, std::uint32_t active) const {
  const int first = std::countr_zero(active);
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
