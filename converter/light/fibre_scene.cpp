#include "converter/light/fibre_scene.h"

#include <algorithm>
#include <cmath>

#include "converter/light/cell_walk.h"

namespace selvedge {
namespace {

/// How far the block reaches beyond the cell, in periods: rays that leave it are shifted by whole periods.
constexpr double reach = 0.25;
/// Rays leave a fibre this share of its radius outside of it.
constexpr double clear = 1e-3;

/// Passes the insides of fibres.
void pass_insides(const RTCFilterFunctionNArguments* args) {
  const unsigned n = args->N;
  for (unsigned i = 0; i < n; ++i) {
    if (args->valid[i] != -1) continue;
    const float facing = RTCHitN_Ng_x(args->hit, n, i) * RTCRayN_dir_x(args->ray, n, i) +
                         RTCHitN_Ng_y(args->hit, n, i) * RTCRayN_dir_y(args->ray, n, i) +
                         RTCHitN_Ng_z(args->hit, n, i) * RTCRayN_dir_z(args->ray, n, i);
    if (facing > 0) args->valid[i] = 0;
  }
}

/// Unit vectors across the fibre: towards the viewer, and at a positive azimuth of a quarter turn.
void frame_of(const FibrePoint& point, V3d& towards, V3d& aside) {
  V3d across = point.view - point.along * point.view.dot(point.along);
  if (across.length2() < 1e-18)
    across = point.along.cross(std::abs(point.along.z) < 0.9 ? V3d(0, 0, 1) : V3d(1, 0, 0));
  towards = across.normalized();
  aside = point.along.cross(towards);
}

}  // namespace

struct FibreSceneState {
  FibreSceneState() = default;
  FibreSceneState(const FibreSceneState&) = delete;
  FibreSceneState& operator=(const FibreSceneState&) = delete;
  ~FibreSceneState() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }

  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  CellBlock block;
  double low = 0;
  double high = 0;
  std::vector<V4f> vertices;       // x, y, z, radius
  std::vector<unsigned> segments;  // first vertex of each
  std::vector<unsigned char> flags;
  std::vector<int> yarn;  // of each segment
};

namespace {

/// The segments of all cells that reach into the block.
void gather(const Fibres& fibres, FibreSceneState& state) {
  const V2d period = fibres.period;
  const auto cells = [&](int axis) {
    double most = 0;
    for (const V3f& p : fibres.points) most = std::max(most, std::abs(static_cast<double>(p[axis])));
    return static_cast<int>(std::ceil(most / period[axis])) + 1;
  };
  const V2i most(cells(0), cells(1));
  for (int f = 0; f < fibres.count(); ++f) {
    const float radius = fibres.radius[f];
    const int end = fibres.first[f + 1];
    const auto inside = [&](int p, const V2d& shift) {  // the segment from point p
      for (int axis = 0; axis < 2; ++axis) {
        const double a = static_cast<double>(fibres.points[p][axis]) + shift[axis];
        const double b = static_cast<double>(fibres.points[p + 1][axis]) + shift[axis];
        const auto r = static_cast<double>(radius);
        if (std::max(a, b) + r < state.block.min[axis] || std::min(a, b) - r > state.block.max[axis])
          return false;
      }
      return true;
    };
    for (int cy = -most.y; cy <= most.y; ++cy) {
      for (int cx = -most.x; cx <= most.x; ++cx) {
        const V2d shift(cx * period.x, cy * period.y);
        bool before = false;
        for (int p = fibres.first[f]; p + 1 < end; ++p) {
          const bool here = inside(p, shift);
          const auto put = [&](int point) {
            const V3d at = V3d(fibres.points[point]) + V3d(shift.x, shift.y, 0);
            state.vertices.emplace_back(static_cast<float>(at.x), static_cast<float>(at.y),
                                        static_cast<float>(at.z), radius);
          };
          if (here) {
            if (!before) put(p);
            put(p + 1);
            if (before) state.flags.back() |= RTC_CURVE_FLAG_NEIGHBOR_RIGHT;
            state.segments.push_back(static_cast<unsigned>(state.vertices.size()) - 2);
            state.flags.push_back(before ? RTC_CURVE_FLAG_NEIGHBOR_LEFT : 0);
            state.yarn.push_back(fibres.yarn[f]);
          }
          before = here;
        }
      }
    }
  }
}

bool attach(FibreSceneState& state) {
  RTCGeometry geometry = rtcNewGeometry(state.device, RTC_GEOMETRY_TYPE_ROUND_LINEAR_CURVE);
  const auto fill = [&](RTCBufferType type, RTCFormat format, const auto& values) {
    using Value = std::remove_cvref_t<decltype(values[0])>;
    void* buffer = rtcSetNewGeometryBuffer(geometry, type, 0, format, sizeof(Value), values.size());
    if (buffer != nullptr) std::copy(values.begin(), values.end(), static_cast<Value*>(buffer));
    return buffer != nullptr;
  };
  const bool whole = fill(RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, state.vertices) &&
                     fill(RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT, state.segments) &&
                     fill(RTC_BUFFER_TYPE_FLAGS, RTC_FORMAT_UCHAR, state.flags);
  if (whole) {
    rtcSetGeometryIntersectFilterFunction(geometry, pass_insides);
    rtcSetGeometryOccludedFilterFunction(geometry, pass_insides);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(state.scene, geometry);
  }
  rtcReleaseGeometry(geometry);
  return whole;
}

}  // namespace

FibreScene::FibreScene(std::unique_ptr<FibreSceneState> state) : state_(std::move(state)) {}
FibreScene::FibreScene(FibreScene&&) noexcept = default;
FibreScene& FibreScene::operator=(FibreScene&&) noexcept = default;
FibreScene::~FibreScene() = default;
V2d FibreScene::period() const { return state_->block.period; }
double FibreScene::low() const { return state_->low; }
double FibreScene::high() const { return state_->high; }

Result<FibreScene> FibreScene::create(const Fibres& fibres, const std::string& name) {
  auto state = std::make_unique<FibreSceneState>();
  state->block.period = fibres.period;
  state->block.min = fibres.period * -reach;
  state->block.max = fibres.period * (1 + reach);
  gather(fibres, *state);
  if (state->segments.empty()) return fail(Code::mesh_empty, name, {}, "the yarns have no fibres");
  state->low = state->high = static_cast<double>(fibres.points.front().z);
  for (const V4f& v : state->vertices) {
    state->low = std::min(state->low, static_cast<double>(v.z - v.w));
    state->high = std::max(state->high, static_cast<double>(v.z + v.w));
  }
  const double margin = 1e-3 * std::max(fibres.period.x, fibres.period.y);
  state->block.z_low = state->low - margin;
  state->block.z_high = state->high + margin;
  state->device = rtcNewDevice(nullptr);
  if (state->device == nullptr) return fail(Code::mesh_invalid, name, {}, "the ray tracer cannot be started");
  state->scene = rtcNewScene(state->device);
  if (!attach(*state)) return fail(Code::mesh_invalid, name, {}, "not enough memory for the ray tracer");
  rtcCommitScene(state->scene);
  if (rtcGetDeviceError(state->device) != RTC_ERROR_NONE) {
    return fail(Code::mesh_invalid, name, {}, "the ray tracer refuses the fibres");
  }
  return FibreScene(std::move(state));
}

bool FibreScene::trace(const V3d& origin, const V3d& direction, FibrePoint& point) const {
  const FibreSceneState& s = *state_;
  return walk(s.block, origin, direction, [&](const V3d& start, double far) {
    RTCRayHit query{};
    query.ray = ray_from(start, direction, far);
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(s.scene, &context, &query);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
    const unsigned first = s.segments[query.hit.primID];
    const V3d a(s.vertices[first].x, s.vertices[first].y, s.vertices[first].z);
    const V3d b(s.vertices[first + 1].x, s.vertices[first + 1].y, s.vertices[first + 1].z);
    const V3d met = start + direction * static_cast<double>(query.ray.tfar);
    point.along = (b - a).normalized();
    point.axis = a + point.along * (met - a).dot(point.along);
    point.radius = static_cast<double>(s.vertices[first].w);
    point.view = -direction;
    point.yarn = s.yarn[query.hit.primID];
    V3d towards;
    V3d aside;
    frame_of(point, towards, aside);
    const V3d out = met - point.axis;
    point.offset = std::clamp(-out.dot(aside) / std::max(1e-12, out.length()), -1.0, 1.0);
    return true;
  });
}

bool FibreScene::occluded(const V3d& origin, const V3d& direction) const {
  const FibreSceneState& s = *state_;
  return walk(s.block, origin, direction, [&](const V3d& start, double far) {
    RTCRay ray = ray_from(start, direction, far);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(s.scene, &context, &ray);
    return ray.tfar < 0;
  });
}

V3d FibreScene::leave(const FibrePoint& point, const V3d& direction) {
  V3d out = direction - point.along * direction.dot(point.along);
  if (out.length2() < 1e-18) out = point.view - point.along * point.view.dot(point.along);
  if (out.length2() < 1e-18) return point.axis;
  return point.axis + out.normalized() * (point.radius * (1 + clear));
}

HairDirection hair_direction(const FibrePoint& point, const V3d& light) {
  V3d towards;
  V3d aside;
  frame_of(point, towards, aside);
  return {std::clamp(light.dot(point.along), -1.0, 1.0), std::atan2(light.dot(aside), light.dot(towards))};
}

V3d direction_of(const FibrePoint& point, const HairDirection& light) {
  V3d towards;
  V3d aside;
  frame_of(point, towards, aside);
  const double cosine = std::sqrt(std::max(0.0, 1 - light.sine * light.sine));
  return (point.along * light.sine + towards * (cosine * std::cos(light.azimuth)) +
          aside * (cosine * std::sin(light.azimuth)))
      .normalized();
}

}  // namespace selvedge
