#include "tests/bench/fibres.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "converter/light/cell_walk.h"
#include "converter/stitch/fibres.h"
#include "converter/stitch/flat_yarn.h"
#include "converter/stitch/yarn_plies.h"
#include "format/base/guard.h"
#include "tests/bench/yarn_noise.h"

namespace selvedge {

namespace {

using std::numbers::pi;

// Independent rows of noise.
constexpr std::uint64_t stream_place = 41;
constexpr std::uint64_t stream_sway = 42;

/// Points are this far from each other, in radii of the ply.
constexpr double step_radii = 0.6;
/// A fibre keeps its place among others over this length, in radii of the ply.
constexpr double sway_radii = 5;
/// Root mean square of a fibre's way from its place, in distances of fibres.
constexpr double sway = 0.5;
/// Root mean square change of a fibre's thickness to the next, relative.
constexpr double unlike = 0.1;

/// Fraction of a ply's section that is fibre. Yarns are spun to between 0.4 and 0.6.
constexpr double packing = 0.5;

void lay_ply(const Yarn& ply, int index, int each_ply, std::uint64_t seed, Fibres& fibres) {
  const double real = 0.5e-3 * fibre_or_default(ply.fibre_kind).diameter_um;
  const double fill = packing * ply.radius_mm * ply.radius_mm;
  const int count =
      each_ply > 0 ? each_ply : std::max(1, static_cast<int>(std::lround(fill / (real * real))));
  const double radius = std::sqrt(fill / count);
  const YarnFrames frames = frames_of(ply, step_radii * ply.radius_mm);
  const double length = frames.stations.back().arc_length;
  // As the strands at the surface: whole turns, and the frame's rotation is spread along the repeat.
  const double turn =
      2 * pi * static_cast<double>(std::lround(length * ply.twist_per_mm)) - frames.total_turn;
  const int places = std::max(2, static_cast<int>(std::lround(length / (sway_radii * ply.radius_mm))));
  const double room = ply.radius_mm - radius;
  const double between = ply.radius_mm * std::sqrt(pi / count);
  for (int k = 0; k < count; ++k) {
    const std::uint64_t own = hash64(hash64(seed ^ hash64(stream_place + static_cast<std::uint64_t>(index))) ^
                                     static_cast<std::uint64_t>(k));
    // Evenly over a disc: a spiral of golden angles.
    const double r = room * std::sqrt((k + 0.5) / count);
    const double angle = k * pi * (3 - std::sqrt(5.0));
    fibres.first.push_back(static_cast<int>(fibres.points.size()));
    fibres.radius.push_back(static_cast<float>(radius * (1 + unlike * lattice_noise(own, 1))));
    fibres.yarn.push_back(index);
    for (const YarnStation& s : frames.stations) {
      const double fraction = s.arc_length / length;
      const auto noise = [&](std::int64_t row) {
        return sway * between * closed_noise(own ^ hash64(stream_sway), row, places, fraction * places);
      };
      V2d at(r * std::cos(angle) + noise(0), r * std::sin(angle) + noise(1));
      if (at.length() > room) at *= room / at.length();
      at *= strand_swell(ply.swells, fraction * ply.passes, thickness_noise_byte);
      const double turned = turn * fraction;
      const V2d placed(at.x * std::cos(turned) - at.y * std::sin(turned),
                       at.x * std::sin(turned) + at.y * std::cos(turned));
      const V3d off = s.across * placed.x + s.tangent.cross(s.across) * placed.y;
      fibres.points.emplace_back(s.position +
                                 stretched(off, s.squeeze) * round_section_radius(1.0, s.squeeze));
    }
  }
}

void add_hairs(const StitchPattern& pattern, const CellMesh& mesh, Fibres& fibres) {
  std::vector<int> first_ply;  // of curves
  int ply = 0;
  for (const Yarn& yarn : pattern.yarns) {
    const int chains = yarn.plies == 1 ? 1 : std::gcd(ply_twist_of(yarn).ply_shift, yarn.plies);
    const bool each = mesh.yarns.curves[first_ply.size()].plies.count == 1;
    for (int k = 0; k < (each ? chains : 1); ++k) first_ply.push_back(ply + k);
    ply += chains;
  }
  for (std::size_t h = 0; h < mesh.hairs.root_triangles.size(); ++h) {
    const auto first = mesh.hairs.points.begin() + static_cast<std::ptrdiff_t>(h * Hairs::points_per_hair);
    fibres.first.push_back(static_cast<int>(fibres.points.size()));
    fibres.radius.push_back(mesh.hairs.radius[h]);
    fibres.yarn.push_back(first_ply[mesh.yarn_places[mesh.triangles[mesh.hairs.root_triangles[h]].x].curve]);
    fibres.points.insert(fibres.points.end(), first, first + Hairs::points_per_hair);
  }
}

}  // namespace

Fibres lay_fibres(const StitchPattern& pattern, const CellMesh& mesh, int each_ply) {
  const auto laid = value_or_throw(lay_plies(pattern, pattern.name));
  Fibres fibres;
  fibres.period = laid.period_mm;
  for (std::size_t y = 0; y < laid.yarns.size(); ++y) {
    lay_ply(laid.yarns[y], static_cast<int>(y), each_ply, laid.seed, fibres);
    fibres.yarns.push_back(laid.yarns[y]);
    fibres.yarns.back().segments.clear();
  }
  add_hairs(pattern, mesh, fibres);
  fibres.first.push_back(static_cast<int>(fibres.points.size()));
  return fibres;
}

namespace {

constexpr std::size_t paths = 4;

double root(double x) { return std::sqrt(std::max(0.0, x)); }

/// Fraction of unpolarised light that a dielectric reflects.
double fresnel(double cosine, double refraction) {
  const double inside = root(1 - (1 - cosine * cosine) / (refraction * refraction));
  const double s = (cosine - refraction * inside) / (cosine + refraction * inside);
  const double p = (refraction * cosine - inside) / (refraction * cosine + inside);
  return 0.5 * (s * s + p * p);
}

/// exp(-x) times the modified Bessel function of order 0, to 2e-7 (Abramowitz and Stegun 9.8.1 and 9.8.2).
double scaled_bessel(double x) {
  if (x < 3.75) {
    const double t = x / 3.75 * (x / 3.75);
    return std::exp(-x) *
           (1 + t * (3.5156229 +
                     t * (3.0899424 + t * (1.2067492 + t * (0.2659732 + t * (0.0360768 + t * 0.0045813))))));
  }
  const double t = 3.75 / x;
  const double tail = 0.02635537 + t * (-0.01647633 + t * 0.00392377);
  return (0.39894228 +
          t * (0.01328592 +
               t * (0.00225319 + t * (-0.00157565 + t * (0.00916281 + t * (-0.02057706 + t * tail)))))) /
         std::sqrt(x);
}

/// Density over the elevation, whose integral with the cosine is 1 (d'Eon et al. 2011).
double longitudinal(double sine_a, double cosine_a, double sine_b, double cosine_b, double variance) {
  const double x = cosine_a * cosine_b / variance;
  const double top = x - sine_a * sine_b / variance - 1 / variance;  // at most 0
  return scaled_bessel(x) * std::exp(top) / (variance * (1 - std::exp(-2 / variance)));
}

double logistic_up_to(double x, double s) { return 1 / (1 + std::exp(-x / s)); }

/// The logistic distribution, cut to a turn.
double azimuthal(double x, double s) {
  x -= 2 * pi * std::round(x / (2 * pi));
  const double e = std::exp(-std::abs(x) / s);
  return e / (s * (1 + e) * (1 + e)) / (logistic_up_to(pi, s) - logistic_up_to(-pi, s));
}

double sample_azimuthal(double u, double s) {
  const double low = logistic_up_to(-pi, s);
  const double part = low + u * (logistic_up_to(pi, s) - low);
  return std::clamp(-s * std::log(1 / part - 1), -pi, pi);
}

/// The standard deviation along the fibre is this polynomial of the roughness, but for its last term.
constexpr double linear_width = 0.726;
constexpr double square_width = 0.812;

}  // namespace

double hair_roughness(double width) {
  return (std::sqrt(linear_width * linear_width + 4 * square_width * width) - linear_width) /
         (2 * square_width);
}

HairOptics::HairOptics(double refraction, double along, double around, const V3d& colour)
    : refraction_(refraction) {
  const double width = along * (linear_width + square_width * along) + 3.7 * std::pow(along, 20);
  const double variance = std::max(1e-6, width * width);
  spread_ = {variance, 0.25 * variance, 4 * variance, 4 * variance};
  const double b = around;
  scale_ = std::sqrt(pi / 8) * (0.265 * b + 1.194 * b * b + 5.372 * std::pow(b, 22));
  const double fitted = 5.969 - 0.215 * b + b * b * (2.532 + b * (-10.73 + b * (5.574 + b * 0.245)));
  constexpr double darkest = 1e-4;
  for (int c = 0; c < 3; ++c) {
    const double root_of = std::log(std::clamp(colour[c], darkest, 1.0)) / fitted;
    absorption_[c] = root_of * root_of;
  }
}

HairBsdf::HairBsdf(const HairOptics& optics, double view_sine, double offset)
    : optics_(optics), sine_(view_sine), cosine_(root(1 - view_sine * view_sine)) {
  const double h = std::clamp(offset, -1.0, 1.0);
  const double n = optics.refraction_;
  const double bent = root(n * n - sine_ * sine_) / std::max(1e-9, cosine_);  // of the plane across
  out_ = std::asin(h);
  in_ = std::asin(h / bent);
  const double way = 2 * std::cos(in_) / root(1 - sine_ * sine_ / (n * n));  // inside, in radii
  const double f = std::min(1 - 1e-9, fresnel(cosine_ * root(1 - h * h), n));
  for (int c = 0; c < 3; ++c) {
    const double left = std::exp(-optics.absorption_[c] * way);
    fraction_[0][c] = f;
    fraction_[1][c] = (1 - f) * (1 - f) * left;
    fraction_[2][c] = fraction_[1][c] * left * f;
    fraction_[3][c] = fraction_[2][c] * left * f / (1 - left * f);
  }
  double all = 0;
  for (std::size_t p = 0; p < paths; ++p)
    all += chance_[p] = fraction_[p].x + fraction_[p].y + fraction_[p].z;
  for (double& chance : chance_) chance /= all;
}

/// Azimuth at which smooth fibres send all of a path.
double HairBsdf::turn_of(std::size_t path) const {
  const auto p = static_cast<double>(path);
  return 2 * p * in_ - 2 * out_ + p * pi;
}

template <class Value>
Value HairBsdf::sum(const HairDirection& light, const std::array<Value, 4>& fractions) const {
  const double cosine = root(1 - light.sine * light.sine);
  Value value(0);
  for (std::size_t p = 0; p < paths; ++p) {
    const double around =
        p + 1 < paths ? azimuthal(light.azimuth - turn_of(p), optics_.scale_) : 1 / (2 * pi);
    value += fractions[p] * (longitudinal(light.sine, cosine, sine_, cosine_, optics_.spread_[p]) * around);
  }
  return value;
}

V3d HairBsdf::scattered(const HairDirection& light) const { return sum(light, fraction_); }
double HairBsdf::density(const HairDirection& light) const { return sum(light, chance_); }

HairDirection HairBsdf::sample(const V2d& random, const V2d& more) const {
  double x = random.x;
  std::size_t p = 0;
  while (p + 1 < paths && x >= chance_[p]) x -= chance_[p++];
  const double v = optics_.spread_[p];
  const double u = 1 - more.x;  // in (0, 1]
  const double lean = std::max(-1.0, 1 + v * std::log(u + (1 - u) * std::exp(-2 / v)));
  HairDirection light;
  light.sine = -lean * sine_ + root(1 - lean * lean) * std::cos(2 * pi * more.y) * cosine_;
  light.sine = std::clamp(light.sine, -1.0, 1.0);
  light.azimuth = p + 1 < paths ? turn_of(p) + sample_azimuthal(random.y, optics_.scale_) : 2 * pi * random.y;
  return light;
}

namespace {

/// How far the block reaches beyond the cell, in periods: rays that leave it are shifted by whole periods.
constexpr double reach = 0.25;
/// Rays leave a fibre this fraction of its radius outside of it.
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

/// Light in the frame of a fibre's scattering, and back.
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

void attach(FibreSceneState& state) {
  RTCGeometry geometry = rtcNewGeometry(state.device, RTC_GEOMETRY_TYPE_ROUND_LINEAR_CURVE);
  const auto fill = [&](RTCBufferType type, RTCFormat format, const auto& values) {
    using Value = std::remove_cvref_t<decltype(values[0])>;
    void* buffer = rtcSetNewGeometryBuffer(geometry, type, 0, format, sizeof(Value), values.size());
    std::copy(values.begin(), values.end(), static_cast<Value*>(buffer));
  };
  fill(RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, state.vertices);
  fill(RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT, state.segments);
  fill(RTC_BUFFER_TYPE_FLAGS, RTC_FORMAT_UCHAR, state.flags);
  rtcSetGeometryIntersectFilterFunction(geometry, pass_insides);
  rtcSetGeometryOccludedFilterFunction(geometry, pass_insides);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(state.scene, geometry);
  rtcReleaseGeometry(geometry);
}

}  // namespace

FibreScene::FibreScene(const Fibres& fibres) : state_(std::make_unique<FibreSceneState>()) {
  state_->block.period = fibres.period;
  state_->block.min = fibres.period * -reach;
  state_->block.max = fibres.period * (1 + reach);
  gather(fibres, *state_);
  double low = state_->high = static_cast<double>(fibres.points.front().z);
  for (const V4f& v : state_->vertices) {
    low = std::min(low, static_cast<double>(v.z - v.w));
    state_->high = std::max(state_->high, static_cast<double>(v.z + v.w));
  }
  const double margin = 1e-3 * std::max(fibres.period.x, fibres.period.y);
  state_->block.z_low = low - margin;
  state_->block.z_high = state_->high + margin;
  state_->device = rtcNewDevice(nullptr);
  state_->scene = rtcNewScene(state_->device);
  attach(*state_);
  rtcCommitScene(state_->scene);
}

FibreScene::~FibreScene() = default;
V2d FibreScene::period() const { return state_->block.period; }
double FibreScene::high() const { return state_->high; }

bool FibreScene::trace(const V3d& origin, const V3d& direction, FibrePoint& point) const {
  const FibreSceneState& s = *state_;
  return walk_blocks(s.block, origin, direction, [&](const V3d& start, double far) {
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
  return walk_blocks(s.block, origin, direction, [&](const V3d& start, double far) {
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

namespace {

/// Azimuthal roughness (beta_n): sections are not quite round. No fit was found by kind; this is the value of
/// most pictures in the literature.
constexpr double azimuthal_roughness = 0.3;

/// Russian roulette ends paths that carry less than this.
constexpr double dark = 0.1;
/// From here on paths end by chance whatever they carry.
constexpr int long_path = 512;
constexpr double max_survival = 0.99;

}  // namespace

FibreTracer::FibreTracer(const FibreScene& scene, const std::vector<Yarn>& yarns, int bounces)
    : scene_(scene), bounces_(bounces) {
  for (const Yarn& yarn : yarns) {
    const YarnKind fibre = fibre_or_default(yarn.fibre_kind);
    // Gloss::roughness is root 2 times the tangent of the lobe's width.
    const double along = hair_roughness(std::atan(fibre.roughness / std::sqrt(2.0)));
    optics_.emplace_back(fibre.refractive_index, along, azimuthal_roughness, V3d(yarn.albedo));
  }
}

FibreTracer::Escape FibreTracer::follow(const FibrePoint& point, std::span<const V3f> lights,
                                        PathSampler& sampler, std::span<V3d> radiance,
                                        std::uint64_t& rays) const {
  FibrePoint vertex = point;
  Escape path;
  path.throughput = V3d(1, 1, 1);
  for (int depth = 0;; ++depth) {
    const HairBsdf bsdf(optics_[vertex.yarn], vertex.view.dot(vertex.along), vertex.offset);
    for (std::size_t l = 0; l < lights.size(); ++l) {
      const V3d light(lights[l]);
      const V3d sent = bsdf.scattered(hair_direction(vertex, light));
      ++rays;
      if (scene_.occluded(FibreScene::leave(vertex, light), light)) continue;
      radiance[l] += path.throughput * sent;
    }
    if (depth == bounces_) return {};
    const V2d random = sampler.next_pair();
    const HairDirection next = bsdf.sample(random, sampler.next_pair());
    const double density = bsdf.density(next);
    if (!(density > 0)) return {};
    path.throughput *= bsdf.scattered(next) / density;
    const double brightest = std::max({path.throughput.x, path.throughput.y, path.throughput.z});
    const double survival = std::min(depth < long_path ? 1 : max_survival, brightest / dark);
    if (survival < 1) {
      if (!(sampler.next_pair().x < survival)) return {};
      path.throughput /= survival;
    }
    path.direction = direction_of(vertex, next);
    ++rays;
    if (!scene_.trace(FibreScene::leave(vertex, path.direction), path.direction, vertex)) return path;
  }
}

}  // namespace selvedge
