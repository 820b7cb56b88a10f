#include "tests/bench/bare_rays.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <limits>

#include "tests/bench/rows.h"

namespace selvedge {

struct BareTracer::State {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
};

BareTracer::BareTracer(const CellMesh& cell) : state_(std::make_unique<State>()) {
  state_->device = rtcNewDevice(nullptr);
  state_->scene = rtcNewScene(state_->device);
  rtcSetSceneFlags(state_->scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(state_->scene, RTC_BUILD_QUALITY_HIGH);
  RTCGeometry geometry = rtcNewGeometry(state_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  const std::size_t copies = 9;
  auto* position = static_cast<V3f*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(V3f), copies * cell.positions.size()));
  auto* triangle = static_cast<V3i*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(V3i), copies * cell.triangles.size()));
  int first = 0;
  for (int cy = -1; cy <= 1; ++cy) {
    for (int cx = -1; cx <= 1; ++cx) {
      const V3f shift(V3d(cx * cell.period.x, cy * cell.period.y, 0));
      for (const V3f& p : cell.positions) *position++ = p + shift;
      for (const V3i& t : cell.triangles) *triangle++ = t + V3i(first);
      first += static_cast<int>(cell.positions.size());
    }
  }
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(state_->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(state_->scene);
}

BareTracer::~BareTracer() {
  rtcReleaseScene(state_->scene);
  rtcReleaseDevice(state_->device);
}

namespace {

struct alignas(64) Valid {
  std::array<int, 16> lane;
};

void set_rays(const BareRays& from, RTCRay16& rays, Valid& valid) {
  std::copy(from.x.begin(), from.x.end(), rays.org_x);
  std::copy(from.y.begin(), from.y.end(), rays.org_y);
  std::copy(from.z.begin(), from.z.end(), rays.org_z);
  std::copy(from.dx.begin(), from.dx.end(), rays.dir_x);
  std::copy(from.dy.begin(), from.dy.end(), rays.dir_y);
  std::copy(from.dz.begin(), from.dz.end(), rays.dir_z);
  std::fill_n(rays.tnear, 16, 0.0F);
  std::fill_n(rays.tfar, 16, std::numeric_limits<float>::infinity());
  for (std::size_t i = 0; i < 16; ++i) valid.lane[i] = (from.active >> i & 1U) != 0 ? -1 : 0;
}

template <class Query, class Rays, class Trace>
double seconds_of(std::span<const BareRays> packets, const Rays& rays_of, const Trace& trace) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  Query query{};
  std::fill_n(rays_of(query).mask, 16, 0xffffffffU);
  const double start = bench::cpu_seconds();
  for (const BareRays& packet : packets) {
    Valid valid{};
    set_rays(packet, rays_of(query), valid);
    trace(valid.lane.data(), context, query);
  }
  return bench::cpu_seconds() - start;
}

}  // namespace

double BareTracer::nearest(std::span<const BareRays> packets) const {
  return seconds_of<RTCRayHit16>(
      packets, [](RTCRayHit16& q) -> RTCRay16& { return q.ray; },
      [&](const int* valid, RTCIntersectContext& context, RTCRayHit16& query) {
        std::fill_n(query.hit.geomID, 16, RTC_INVALID_GEOMETRY_ID);
        rtcIntersect16(valid, state_->scene, &context, &query);
      });
}

double BareTracer::any(std::span<const BareRays> packets) const {
  return seconds_of<RTCRay16>(
      packets, [](RTCRay16& q) -> RTCRay16& { return q; },
      [&](const int* valid, RTCIntersectContext& context, RTCRay16& query) {
        rtcOccluded16(valid, state_->scene, &context, &query);
      });
}

}  // namespace selvedge
