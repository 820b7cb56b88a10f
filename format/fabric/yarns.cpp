#include "format/fabric/yarns.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "format/fabric/directions.h"
#include "format/fabric/lifted.h"

namespace selvedge {
namespace {

tl::unexpected<Error> refuse(const std::string& place, std::string why) {
  return fail(Code::fabric_malformed, {}, place, std::move(why));
}

bool in(float value, float low, float high) { return value >= low && value <= high; }

/// Yarns reach no further from the origin, in periods of the axis; heights, in the longer period.
constexpr float max_reach = 64;
constexpr float max_radius = 2;  ///< in the shorter period
constexpr int max_plies = 8;
constexpr int max_divisions = 64;
constexpr int max_shift = 4096;
/// Times that all yarn covers the cell: knits and weaves do 6 to 13 times. Work on an image of the cell grows
/// with it, as rays' work does.
constexpr double max_cover = 1024;
/// Hairs cost more than yarn, and are drawn as wide as an eighth of it.
constexpr double drawn_cost_of_hairs = 8;

Result<void> check_plies(const YarnPlies& p, const std::string& place) {
  if (p.count < 1 || p.count > max_plies) return refuse(place, fmt::format("is of 1 to {} plies", max_plies));
  if (p.divisions < 1 || p.divisions > (p.count == 1 ? 1 : max_divisions))
    return refuse(place, "has divisions out of range");
  if (std::abs(p.shift) > max_shift) return refuse(place, "has plies that turn too often");
  if (!in(p.phase, -std::numbers::pi_v<float>, std::numbers::pi_v<float>))
    return refuse(place, "has a phase out of range");
  for (int k = 0; k < 3; ++k)
    if (!in(p.outward_gain[k], -4, 4)) return refuse(place, "has a groove outside of [-4, 4]");
  if (p.sides != 0 && p.sides != 1) return refuse(place, "has sides that are neither 0 nor 1");
  return {};
}

Result<void> check_strands(const YarnStrands& s, const std::string& place) {
  if (std::abs(s.count) > max_strands) return refuse(place, "has too many strands");
  if (s.noise_pieces < 2 || s.noise_pieces > max_noise_pieces || s.swells < 1 || s.swells > max_noise_pieces)
    return refuse(place, "has pieces or swells out of range");
  if (std::abs(s.shift) > max_noise_pieces) return refuse(place, "has strands that turn too often");
  if (s.seed < 0 || s.seed > max_strand_seed) return refuse(place, "has a seed out of range");
  if (!in(s.irregularity, 0, max_irregularity)) return refuse(place, "has an irregularity out of range");
  if (!in(s.contrast, 0, max_contrast)) return refuse(place, "has a contrast out of range");
  if (!in(s.row_variation, 0, max_row_variation)) return refuse(place, "has a change out of range");
  if (!in(s.marl, 0, max_marl)) return refuse(place, "has a marl out of range");
  return {};
}

Result<void> check_hairs(const YarnHairs& h, float shorter, const std::string& place) {
  if (std::abs(h.count) > max_hairs) return refuse(place, "has too many hairs");
  if (!in(h.mean_length, 0, max_radius * shorter) || !in(h.radius, 0, max_radius * shorter))
    return refuse(place, "has hairs whose length or radius is out of range");
  if (!in(h.loop_fraction, 0, 1) || !in(h.opacity, 0, 1))
    return refuse(place, "has a fraction outside of [0, 1]");
  if (h.count != 0 && !(h.mean_length > 0 && h.radius * h.opacity > 0))
    return refuse(place, "has hairs without length or radius");
  return {};
}

Result<void> check_curve(const YarnCurve& c, float shorter, const std::string& place) {
  if (c.nodes < 2) return refuse(place, fmt::format("has {} nodes; needs 2", c.nodes));
  if (c.stations < 1) return refuse(place, "has no station");
  if (!(c.radius > 0 && c.radius <= max_radius * shorter)) return refuse(place, "has a radius out of range");
  for (int k = 0; k < 3; ++k)
    if (!in(c.albedo[k], 0, 1)) return refuse(place, "has an albedo outside of [0, 1]");
  if (!in(c.gloss.weight, 0, 1)) return refuse(place, "has a gloss outside of [0, 1]");
  if (!in(c.gloss.lustre, 0, max_lustre)) return refuse(place, "has a lustre out of range");
  if (!(c.gloss.roughness > 0 && c.gloss.roughness <= 1))
    return refuse(place, "has a roughness out of range");
  if (!std::isfinite(c.fibre_slope)) return refuse(place, "has a slope that is not finite");
  if (std::max(std::abs(c.repeat_offset.x), std::abs(c.repeat_offset.y)) > static_cast<int>(max_reach))
    return refuse(place, "turns too often");
  if (!in(c.flattening, min_flattening, 1)) return refuse(place, "has a flattening out of range");
  if (!c.squeezes.empty() && c.squeezes.size() != static_cast<std::size_t>(c.nodes))
    return refuse(place, "needs one squeeze per node");
  for (const V3f& squeeze : c.squeezes)
    if (!in(squeeze.length2(), 0, 1 - min_flattening)) return refuse(place, "has a squeeze out of range");
  if (auto ok = check_plies(c.plies, place); !ok) return ok;
  if (auto ok = check_strands(c.strands, place); !ok) return ok;
  return check_hairs(c.hairs, shorter, place);
}

/// Precondition: the nodes of axes are where they may be.
Result<void> check_segments(const YarnData& data, const V2f& period) {
  if (piece_count(data) > max_piece_count)
    return refuse("nodes", fmt::format("plies and hairs have more than {}", max_piece_count));
  Result<void> result;
  double covered = 0;  // mm^2
  for_each_curve(data, [&](std::size_t c, const YarnCurve& curve, std::span<const V3f> own) {
    if (!result) return;
    const std::string place = fmt::format("curve {}", c);
    const auto area = [](double radius, double length, double count) {
      return 2 * radius * (length + count * radius);
    };
    double length = 0;
    bool is_short = false;
    (void)holds_for_plies(curve, own, period, [&](std::span<const V3d> ends) {
      for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
        const float along = V3f(ends[i + 1] - ends[i]).length();
        length += static_cast<double>(along);
        is_short |= !(along >= 1e-2F * ply_or_yarn_radius(curve));
      }
      return true;
    });
    if (is_short && std::ranges::any_of(make_segments(curve, own, period), [](const Yarns::Segment& s) {
          return !(s.along.length() >= 1e-3F * s.radius);
        })) {
      result = refuse(place, "consecutive nodes of a ply coincide");
      return;
    }
    const YarnHairs& h = curve.hairs;
    covered += area(ply_or_yarn_radius(curve), length, static_cast<double>(segment_count(curve))) +
               drawn_cost_of_hairs * std::abs(h.count) *
                   area(std::max(h.radius, curve.radius / 8), h.mean_length, hair_point_count - 1);
    if (covered > max_cover * static_cast<double>(period.x) * static_cast<double>(period.y))
      result = refuse(
          place, fmt::format("covers the cell, with the curves before it, more than {} times", max_cover));
  });
  return result;
}

Result<void> check_map(const YarnData& data) {
  const YarnMap& map = data.map;
  if (map.empty()) return {};
  for (const std::uint16_t shown : map.shown)
    if (shown >= map.kinds.x * map.kinds.y)
      return refuse("map", fmt::format("names stitch {} of {}", shown, map.kinds.x * map.kinds.y));
  for (std::size_t c = 0; c < data.curves.size(); ++c)
    if (const int lines = data.curves[c].repeat_offset.x == 0 ? map.kinds.x : map.kinds.y;
        map.lines[c] < 0 || map.lines[c] >= lines)
      return refuse("map", fmt::format("curve {} is not in one of {} lines", c, lines));
  return {};
}

/// The numbers of light from number `first` on at a place between two stations, one after the other.
class LightBetween {
 public:
  LightBetween(const std::vector<float>& light, int first_station, int stations, float station, int first) {
    const auto whole = static_cast<int>(station);
    const auto numbers = [&](int i) {
      return &light[std::size_t{light_values_per_station} * (first_station + i % stations) + first];
    };
    here_ = numbers(whole);
    next_ = numbers(whole + 1);
    fraction_ = station - static_cast<float>(whole);
  }
  float take() { return *here_++ * (1 - fraction_) + *next_++ * fraction_; }

 private:
  const float* here_;
  const float* next_;
  float fraction_;
};

}  // namespace

std::int64_t piece_count(const YarnData& data) {
  std::int64_t nodes = 0;
  for (const YarnCurve& c : data.curves)
    nodes += segment_count(c) + std::int64_t{hair_point_count} * std::abs(c.hairs.count);
  return nodes;
}

Result<void> validate(const YarnData& data, const V2f& period) {
  const V3f reach = V3f(period.x, period.y, std::max(period.x, period.y)) * max_reach;
  for (std::size_t n = 0; n < data.nodes.size(); ++n)
    for (int k = 0; k < 3; ++k)
      if (!in(data.nodes[n][k], -reach[k], reach[k]))
        return refuse(fmt::format("node {}", n), "is out of range or not finite");
  std::size_t first = 0;
  std::size_t stations = 0;
  if (data.curves.empty()) return refuse("curves", "no curves");
  for (std::size_t c = 0; c < data.curves.size(); ++c) {
    const YarnCurve& curve = data.curves[c];
    const std::string place = fmt::format("curve {}", c);
    if (auto ok = check_curve(curve, std::min(period.x, period.y), place); !ok) return ok;
    if (data.nodes.size() - first < static_cast<std::size_t>(curve.nodes))
      return refuse(place, "has nodes beyond the last");
    for (std::size_t n = first; n < first + curve.nodes; ++n) {
      const bool last = n + 1 == first + curve.nodes;
      const V3f next = last ? data.nodes[first] + V3f(static_cast<float>(curve.repeat_offset.x) * period.x,
                                                      static_cast<float>(curve.repeat_offset.y) * period.y, 0)
                            : data.nodes[n + 1];
      const float length = (next - data.nodes[n]).length();
      if (!(length >= 1e-3F * curve.radius))
        return refuse(fmt::format("node {}", n), "coincides with the next");
    }
    first += curve.nodes;
    stations += curve.stations;
  }
  if (first != data.nodes.size()) return refuse("nodes", "there are more than the curves have");
  if (auto ok = check_segments(data, period); !ok) return ok;
  if (auto ok = check_map(data); !ok) return ok;
  for (const auto* light : {&data.station_light, &data.light_through}) {
    if (light->empty() && light == &data.light_through) continue;
    if (light->size() != stations * light_values_per_station)
      return refuse("light", "station count does not match the curves");
    for (const float value : *light)
      if (!std::isfinite(value)) return refuse("light", "a value is not finite");
  }
  return {};
}

std::array<float, angle_function_count> angle_basis(float cosine, float sine) {
  return {1, cosine, sine, cosine * cosine - sine * sine, 2 * cosine * sine};
}

std::array<float, angle_function_count> angle_factors(const YarnPlies& plies, const YarnPoint& point) {
  if (plies.sides != 0) return {1, point.angle_cosine, point.angle_sine, point.ply_side.x, point.ply_side.y};
  return angle_basis(point.angle_cosine, point.angle_sine);
}

std::array<float, yarn_light_function_count> light_basis(const V3f& l) {
  std::array<float, yarn_light_function_count> basis{
      1, l.x, l.y, l.z, l.x * l.y, l.x * l.z, l.y * l.z, l.x * l.x - l.y * l.y, 3 * l.z * l.z - 1};
  for (float& b : basis) b *= l.z;
  return basis;
}

Yarns::Yarns(YarnData data, const V2f& period) : data_(std::move(data)), period_(period) {
  int station = 0;
  for (const YarnCurve& curve : data_.curves)
    first_station_.push_back(std::exchange(station, station + curve.stations));
}

Yarns::Geometry Yarns::geometry() const {
  std::call_once(derived_->segments_once, [&] { derive_segments(); });
  const Derived& all = *derived_;
  return {all.low, all.high, all.segments, first_station_, all.strand_sense, all.stitches};
}

const Yarns::Grid& Yarns::grid() const {
  std::call_once(derived_->grid_once, [&] { derived_->grid = placed_in_cells(); });
  return derived_->grid;
}

const Variation& Yarns::variation() const {
  std::call_once(derived_->variation_once, [&] { derived_->variation = variation_of(*this); });
  return derived_->variation;
}

YarnPoint Yarns::point_at(const YarnHit& hit) const {
  const Segment& s = geometry().segments[hit.segment];
  const YarnCurve& curve = data_.curves[s.curve];
  YarnPoint point;
  point.curve = s.curve;
  point.is_hair = s.hair_threshold > 0;
  // The nearest point of the cubic curve through the nodes with these tangents, by a step of Newton's method
  // from the straight line's: the surface is as smooth as the curve.
  const float length = std::sqrt(1 / s.inverse_length2);
  const V3f from_start = squeezed(hit.start_offset, s.squeeze);
  const V3f along = squeezed(s.along, s.squeeze);
  const V3f first = squeezed(s.tangent[0], s.squeeze) * length;
  const V3f second = squeezed(s.tangent[1], s.squeeze) * length;
  float fraction = 0;
  V3f out(0, 0, 0);
  V3f tangent(0, 0, 0);
  for (int step = 0; step < 2; ++step) {
    const float next = step == 0 ? from_start.dot(along) * s.inverse_length2
                                 : fraction + out.dot(tangent) / tangent.length2();
    fraction = std::clamp(next, -0.25F, 1.25F);
    const float rest = 1 - fraction;
    tangent = along * (6 * fraction * rest) + first * (rest * (1 - 3 * fraction)) +
              second * (fraction * (3 * fraction - 2));
    out = from_start - along * (fraction * fraction * (3 - 2 * fraction)) - first * (fraction * rest * rest) +
          second * (fraction * fraction * rest);
  }
  tangent.normalize();
  point.station = s.start_station + fraction * s.station_span;
  if (point.station < 0) point.station += static_cast<float>(curve.stations);
  point.normal = (out - tangent * tangent.dot(out)).normalized();
  const V3f around = tangent.cross(point.normal);
  if (point.is_hair) {
    point.fibre = tangent;
    point.angle_cosine = s.across[0].x;
    point.angle_sine = s.across[0].y;
    point.outward_cosine = s.across[0].z;
    point.ply_side = {s.across[1].x, s.across[1].y};
    point.strand_normal = point.normal;
    return point;
  }
  point.fibre = stretched(tangent + around * curve.fibre_slope, s.squeeze).normalized();
  const V3f across = mix(s.across[0], s.across[1], fraction);
  const float cosine = point.normal.dot(across);
  const float sine = -around.dot(across);
  const float norm = std::hypot(cosine, sine);
  point.angle_cosine = norm > 0 ? cosine / norm : 1;
  point.angle_sine = norm > 0 ? sine / norm : 0;
  const V3f out_of_axis = mix(s.axis_to_ply[0], s.axis_to_ply[1], fraction);
  point.outward_cosine = point.normal.dot(out_of_axis);
  point.ply_side = {out_of_axis.dot(across), out_of_axis.dot(tangent.cross(across))};
  point.normal = squeezed(point.normal, s.squeeze).normalized();
  point.strand_normal = point.normal;
  point.rows = s.rows;
  return point;
}

void Yarns::perturb_by_strands(YarnPoint& point, const V3f& view) const {
  const YarnCurve& curve = data_.curves[point.curve];
  if (!curve.strands.varies()) return;
  if (point.is_hair) {
    point.brightness =
        strand_swell(curve.strands, point.station / static_cast<float>(curve.stations), colour_noise_byte);
    return;
  }
  const V2f& sense = derived_->strand_sense[point.curve];
  const float around =
      std::atan2(sense.y * point.angle_sine, sense.x * point.angle_cosine) / (2 * std::numbers::pi_v<float>);
  const float fraction = point.station / static_cast<float>(curve.stations);
  const StrandPerturbation<float> change = strand_perturbation(curve.strands, around, fraction, point.rows);
  point.brightness = change.brightness;
  if (curve.strands.count != 0) perturb_by_strand(change, clamp_rise(view), point.strand_normal, point.fibre);
}

V3f Yarns::direct_reflectance(const YarnPoint& point, const V3f& light, const V3f& view) const {
  const YarnCurve& curve = data_.curves[point.curve];
  const V3f l = clamp_rise(light);
  const V3f& normal = point.strand_normal;
  const float cosine = normal.dot(l);
  if (!(cosine > 0)) return {0, 0, 0};
  V3f f = curve.albedo * point.brightness;
  for (int c = 0; c < 3; ++c) f[c] = std::min(f[c], 1.0F);
  f *= 1 - curve.gloss.weight;
  if (curve.gloss.weight == 0 && curve.gloss.lustre == 0) {
    f *= std::numbers::inv_pi_v<float>;
  } else {
    V3f v = clamp_rise(view);
    v = (v + normal * std::max(0.0F, min_facing_cosine - normal.dot(v))).normalized();
    const V3f across = normal.cross(point.fibre);
    const V3f local_light(l.dot(point.fibre), l.dot(across), cosine);
    const V3f local_view(v.dot(point.fibre), v.dot(across), v.dot(normal));
    const auto& [weight, roughness, lustre] = curve.gloss;
    f = f * body_reflectance(local_light.x, local_view.x, lustre) +
        V3f(weight * gloss_reflectance(local_light, local_view, roughness));
  }
  // No step where the light sets.
  return f * (cosine * std::min(1.0F, light.z / min_ray_rise));
}

LightTransfer Yarns::transfer_at(const YarnPoint& point, bool through) const {
  const std::vector<float>& light = through ? data_.light_through : data_.station_light;
  if (light.empty()) return {};
  const YarnCurve& curve = data_.curves[point.curve];
  LightBetween numbers(light, first_station_[point.curve], curve.stations, point.station, 0);
  LightTransfer transfer{};
  for (const float a : angle_factors(curve.plies, point))
    for (float& c : transfer) c += a * numbers.take();
  for (std::size_t i = 0; i < transfer.size(); ++i)
    transfer[i] *= 1 + curve.plies.outward_gain[static_cast<int>(i % 3)] * point.outward_cosine;
  return transfer;
}

float Yarns::lustre_view_factor(const YarnPoint& point, const V3f& view) const {
  const YarnCurve& curve = data_.curves[point.curve];
  const float lustre = curve.gloss.lustre;
  if (data_.station_light.empty() || lustre == 0 || point.is_hair) return 1;
  LightBetween numbers(data_.station_light, first_station_[point.curve], curve.stations, point.station,
                       transfer_values_per_station);
  std::array<float, light_moment_count> mean{};
  for (float& m : mean)
    for (const float a : angle_factors(curve.plies, point)) m += a * numbers.take();
  V3f v = clamp_rise(view);
  v = (v + point.strand_normal * std::max(0.0F, min_facing_cosine - point.strand_normal.dot(v))).normalized();
  return lustre_factor(v.dot(point.fibre), lustre, mean[0], mean[1]);
}

V3f indirect_light(const LightTransfer& transfer, const V3f& light) {
  V3f sum(0, 0, 0);
  const float* c = transfer.data();
  for (const float b : light_basis(light)) {
    sum += V3f(c[0], c[1], c[2]) * b;
    c += 3;
  }
  for (int i = 0; i < 3; ++i) sum[i] = std::max(0.0F, sum[i]);
  return sum;
}

V2d Yarns::displaced_place(const V2d& uv) const {
  return selvedge::displaced_place(variation(), uv * tiles_per_repeat()) / tiles_per_repeat();
}

float Yarns::variation_factor(const V2d& uv, int curve) const {
  const RepeatPlace place = repeat_place(uv * tiles_per_repeat());
  if (curve < 0) return variation_at(variation(), place, variation().along_v_fraction);
  return variation_at(variation(), place, runs_along_v(data_.curves[curve], period_) ? 1.0F : 0.0F);
}

Shading Yarns::shade(const V2d& uv, float plane, const V3f& light, const V3f& view, bool varied) const {
  const auto hit = trace(uv, plane, view);
  Shading shading;
  if (!hit) return shading;
  shading.alpha = 1;
  if (light.z == 0 || !(view.z > 0)) return shading;
  YarnPoint point = point_at(*hit);
  perturb_by_strands(point, view);
  const float factor = varied ? variation_factor(uv, point.curve) : 1;
  if (light.z < 0) {
    shading.radiance =
        indirect_light(transfer_at(point, true), mirrored(light)) * (point.brightness * factor);
    return shading;
  }
  shading.radiance =
      indirect_light(transfer_at(point), light) * (point.brightness * lustre_view_factor(point, view));
  const V3f lit = direct_reflectance(point, light, view);
  if (lit != V3f(0, 0, 0) && !is_occluded(*hit, point, light)) shading.radiance += lit;
  shading.radiance *= factor;
  return shading;
}

}  // namespace selvedge
