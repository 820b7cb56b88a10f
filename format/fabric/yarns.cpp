#include "format/fabric/yarns.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "format/fabric/directions.h"
#include "format/fabric/lifted.h"

namespace selvedge {
namespace {

/// `across` of one node carried to the next by two reflections (Wang et al. 2008): the least turn about the
/// chain.
V3d carried(const V3d& across, const V3d& way, const V3d& tangent, const V3d& next_tangent) {
  const double way2 = way.length2();
  const V3d reflected = across - way * (2 * way.dot(across) / way2);
  const V3d turn = next_tangent - (tangent - way * (2 * way.dot(tangent) / way2));
  const double turn2 = turn.length2();
  return turn2 == 0 ? reflected : reflected - turn * (2 * turn.dot(reflected) / turn2);
}

V3d any_across(const V3d& tangent) {
  const V3d axis = counts_from_the_side(V3f(tangent)) ? V3d(1, 0, 0) : V3d(0, 0, 1);
  return (axis - tangent * axis.dot(tangent)).normalized();
}

V3d rotated(const V3d& d, const V3d& unit_axis, double angle) {
  return d * std::cos(angle) + unit_axis.cross(d) * std::sin(angle);
}

V3f mix(const V3f& a, const V3f& b, float share) { return a + (b - a) * share; }

tl::unexpected<Error> refuse(const std::string& place, std::string why) {
  return fail(Code::fabric_malformed, {}, place, std::move(why));
}

bool in(float value, float low, float high) { return value >= low && value <= high; }

/// Yarns reach no further from the origin, in periods of the axis; heights, in those of the longer.
constexpr float max_reach = 64;
constexpr float max_radius = 2;  ///< in the shorter period
constexpr int max_plies = 8;
constexpr int max_divisions = 64;
constexpr int max_shift = 4096;

Result<void> check_plies(const YarnPlies& p, const std::string& place) {
  if (p.count < 1 || p.count > max_plies) return refuse(place, fmt::format("is of 1 to {} plies", max_plies));
  if (p.divisions < 1 || p.divisions > (p.count == 1 ? 1 : max_divisions))
    return refuse(place, "has divisions out of range");
  if (std::abs(p.shift) > max_shift) return refuse(place, "has plies that turn too often");
  if (!in(p.phase, -std::numbers::pi_v<float>, std::numbers::pi_v<float>))
    return refuse(place, "has a phase out of range");
  for (int k = 0; k < 3; ++k) {
    if (!in(p.groove[k], -1, 1)) return refuse(place, "has a groove outside of [-1, 1]");
  }
  return {};
}

Result<void> check_strands(const YarnStrands& s, const std::string& place) {
  if (std::abs(s.count) > max_strands) return refuse(place, "has too many strands");
  if (s.pieces < 2 || s.pieces > max_pieces || s.swells < 1 || s.swells > max_pieces)
    return refuse(place, "has pieces or swells out of range");
  if (std::abs(s.shift) > max_pieces) return refuse(place, "has strands that turn too often");
  if (s.seed < 0 || s.seed > max_strand_seed) return refuse(place, "has a seed out of range");
  if (!in(s.irregularity, 0, max_irregularity)) return refuse(place, "has an irregularity out of range");
  return {};
}

Result<void> check_curve(const YarnCurve& c, float shorter, const std::string& place) {
  if (c.nodes < 2) return refuse(place, fmt::format("has {} nodes; needs 2", c.nodes));
  if (c.stations < 1) return refuse(place, "has no station");
  if (!(c.radius > 0 && c.radius <= max_radius * shorter)) return refuse(place, "has a radius out of range");
  for (int k = 0; k < 3; ++k) {
    if (!in(c.albedo[k], 0, 1)) return refuse(place, "has an albedo outside of [0, 1]");
  }
  if (!in(c.gloss.weight, 0, 1)) return refuse(place, "has a gloss outside of [0, 1]");
  if (!(c.gloss.roughness > 0 && c.gloss.roughness <= 1))
    return refuse(place, "has a roughness out of range");
  if (!std::isfinite(c.fibre_slope)) return refuse(place, "has a slope that is not finite");
  if (std::max(std::abs(c.turns.x), std::abs(c.turns.y)) > static_cast<int>(max_reach))
    return refuse(place, "turns too often");
  if (auto ok = check_plies(c.plies, place); !ok) return ok;
  return check_strands(c.strands, place);
}

}  // namespace

Result<void> validate(const YarnData& data, const V2f& period) {
  const V3f reach = V3f(period.x, period.y, std::max(period.x, period.y)) * max_reach;
  for (std::size_t n = 0; n < data.nodes.size(); ++n) {
    for (int k = 0; k < 3; ++k) {
      if (!in(data.nodes[n][k], -reach[k], reach[k])) {
        return refuse(fmt::format("node {}", n), "lies too far away or nowhere");
      }
    }
  }
  std::size_t first = 0;
  std::size_t stations = 0;
  if (data.curves.empty()) return refuse("curves", "there is none");
  for (std::size_t c = 0; c < data.curves.size(); ++c) {
    const YarnCurve& curve = data.curves[c];
    const std::string place = fmt::format("curve {}", c);
    if (auto ok = check_curve(curve, std::min(period.x, period.y), place); !ok) return ok;
    if (data.nodes.size() - first < static_cast<std::size_t>(curve.nodes))
      return refuse(place, "has nodes beyond the last");
    for (std::size_t n = first; n < first + curve.nodes; ++n) {
      const bool last = n + 1 == first + curve.nodes;
      const V3f next = last ? data.nodes[first] + V3f(static_cast<float>(curve.turns.x) * period.x,
                                                      static_cast<float>(curve.turns.y) * period.y, 0)
                            : data.nodes[n + 1];
      const float length = (next - data.nodes[n]).length();
      if (!(length >= 1e-3F * curve.radius))
        return refuse(fmt::format("node {}", n), "lies where the next does");
    }
    first += curve.nodes;
    stations += curve.stations;
  }
  if (first != data.nodes.size()) return refuse("nodes", "there are more than the curves have");
  for (const auto* light : {&data.light, &data.through}) {
    if (light->empty() && light == &data.through) continue;
    if (light->size() != stations * light_values_per_station)
      return refuse("light", "has not the stations of the curves");
    for (const float value : *light) {
      if (!std::isfinite(value)) return refuse("light", "a value is not finite");
    }
  }
  return {};
}

std::array<float, angle_functions> angle_basis(float cosine, float sine) {
  return {1, cosine, sine, cosine * cosine - sine * sine, 2 * cosine * sine};
}

std::array<float, light_functions_of_yarn> light_basis(const V3f& l) {
  std::array<float, light_functions_of_yarn> basis{
      1, l.x, l.y, l.z, l.x * l.y, l.x * l.z, l.y * l.z, l.x * l.x - l.y * l.y, 3 * l.z * l.z - 1};
  for (float& b : basis) b *= l.z;
  return basis;
}

Yarns::Yarns(YarnData data, const V2f& period) : data_(std::move(data)), period_(period) {
  derive_segments();
  place_in_cells();
}

void Yarns::derive_segments() {
  low_ = std::numeric_limits<float>::max();
  high_ = std::numeric_limits<float>::lowest();
  int first = 0;
  int station = 0;
  for (std::size_t c = 0; c < data_.curves.size(); ++c) {
    const YarnCurve& curve = data_.curves[c];
    const int count = curve.nodes;
    const V3d turns(curve.turns.x * static_cast<double>(period_.x),
                    curve.turns.y * static_cast<double>(period_.y), 0);
    const auto node = [&](int i) {  // -1 <= i <= count + 1
      const int repeat = i < 0 ? -1 : i / count;
      return V3d(data_.nodes[first + i - repeat * count]) + turns * static_cast<double>(repeat);
    };
    const auto tangent = [&](int i) {
      const V3d before = node(i) - node(i - 1);
      const V3d after = node(i + 1) - node(i);
      const V3d sum = before * after.length2() + after * before.length2();
      // A chain that turns straight back has no tangent there.
      return sum.length2() > 0 ? sum.normalized() : after.normalized();
    };
    std::vector<V3d> across{any_across(tangent(0))};
    std::vector<double> length{0};
    for (int i = 0; i < count; ++i) {
      const V3d way = node(i + 1) - node(i);
      across.push_back(carried(across[i], way, tangent(i), tangent(i + 1)));
      length.push_back(length[i] + way.length());
    }
    const double turned =
        std::atan2(across[0].cross(across[count]).dot(tangent(0)), across[0].dot(across[count]));
    const double per_mm = curve.stations / length[count];
    for (int i = 0; i <= count; ++i) {
      across[i] = rotated(across[i], tangent(i), -turned * length[i] / length[count]);
    }
    for (int i = 0; i < count; ++i) {
      Segment s;
      s.start = V3f(node(i));
      s.along = V3f(node(i + 1) - node(i));
      s.tangent = {V3f(tangent(i)), V3f(tangent(i + 1))};
      s.across = {V3f(across[i]), V3f(across[i + 1])};
      s.inverse_length2 = 1 / s.along.length2();
      s.station = static_cast<float>(length[i] * per_mm);
      s.stations = static_cast<float>((length[i + 1] - length[i]) * per_mm);
      s.radius = curve.radius;
      s.curve = static_cast<int>(c);
      segments_.push_back(s);
      low_ = std::min(low_, s.start.z - curve.radius);
      high_ = std::max(high_, s.start.z + curve.radius);
    }
    const bool sideways = counts_from_the_side(V3f(tangent(0)));
    strand_sense_.push_back(curve.strands.count >= 0 ? V2f(1, 1) : sideways ? V2f(1, -1) : V2f(-1, 1));
    first_station_.push_back(station);
    first += count;
    station += curve.stations;
  }
}

YarnPoint Yarns::point_at(const YarnHit& hit) const {
  const Segment& s = segments_[hit.segment];
  const YarnCurve& curve = data_.curves[s.curve];
  YarnPoint point;
  point.curve = s.curve;
  // The nearest point of the cubic curve through the nodes with these tangents, by a step of Newton's method
  // from that of the straight line: the surface is as smooth as the curve.
  const float length = std::sqrt(1 / s.inverse_length2);
  float share = 0;
  V3f out(0, 0, 0);
  V3f tangent(0, 0, 0);
  for (int step = 0; step < 2; ++step) {
    const float next = step == 0 ? hit.from_start.dot(s.along) * s.inverse_length2
                                 : share + out.dot(tangent) / tangent.length2();
    share = std::clamp(next, -0.25F, 1.25F);
    const float rest = 1 - share;
    tangent = s.along * (6 * share * rest) +
              (s.tangent[0] * (rest * (1 - 3 * share)) + s.tangent[1] * (share * (3 * share - 2))) * length;
    out = hit.from_start - s.along * (share * share * (3 - 2 * share)) -
          (s.tangent[0] * (share * rest * rest) - s.tangent[1] * (share * share * rest)) * length;
  }
  tangent.normalize();
  point.station = s.station + share * s.stations;
  if (point.station < 0) point.station += static_cast<float>(curve.stations);
  point.normal = (out - tangent * tangent.dot(out)).normalized();
  point.strand = point.normal;
  const V3f around = tangent.cross(point.normal);
  point.fibre = (tangent + around * curve.fibre_slope).normalized();
  const V3f across = mix(s.across[0], s.across[1], share);
  const float cosine = point.normal.dot(across);
  const float sine = -around.dot(across);
  const float norm = std::hypot(cosine, sine);
  point.cosine = norm > 0 ? cosine / norm : 1;
  point.sine = norm > 0 ? sine / norm : 0;
  return point;
}

void Yarns::add_strands(YarnPoint& point, const V3f& view) const {
  const YarnCurve& curve = data_.curves[point.curve];
  if (!curve.strands.varies()) return;
  const V2f& sense = strand_sense_[point.curve];
  const float around =
      std::atan2(sense.y * point.sine, sense.x * point.cosine) / (2 * std::numbers::pi_v<float>);
  const float share = point.station / static_cast<float>(curve.stations);
  const StrandChange<float> change = strand_change(curve.strands, around, share);
  point.brightness = change.brightness;
  if (curve.strands.count != 0) turn_to_strand(change, lifted(view), point.strand, point.fibre);
}

YarnFrame Yarns::frame_at(int curve, int station) const {
  const auto at = static_cast<float>(station);
  std::size_t i = 0;
  while (segments_[i].curve != curve) ++i;
  while (i + 1 < segments_.size() && segments_[i + 1].curve == curve && segments_[i + 1].station <= at) ++i;
  const Segment& s = segments_[i];
  const float share = std::clamp((at - s.station) / s.stations, 0.0F, 1.0F);
  YarnFrame frame;
  frame.position = s.start + s.along * share;
  frame.tangent = mix(s.tangent[0], s.tangent[1], share).normalized();
  const V3f across = mix(s.across[0], s.across[1], share);
  frame.across = (across - frame.tangent * frame.tangent.dot(across)).normalized();
  return frame;
}

V3f Yarns::direct(const YarnPoint& point, const V3f& light, const V3f& view) const {
  const YarnCurve& curve = data_.curves[point.curve];
  const V3f l = lifted(light);
  const V3f& normal = point.strand;
  const float cosine = normal.dot(l);
  if (!(cosine > 0)) return {0, 0, 0};
  V3f f = curve.albedo * point.brightness;
  for (int c = 0; c < 3; ++c) f[c] = std::min(f[c], 1.0F);
  f *= (1 - curve.gloss.weight) * std::numbers::inv_pi_v<float>;
  if (curve.gloss.weight > 0) {
    V3f v = lifted(view);
    v = (v + normal * std::max(0.0F, min_facing - normal.dot(v))).normalized();
    const V3f across = normal.cross(point.fibre);
    const V3f local_light(l.dot(point.fibre), l.dot(across), cosine);
    const V3f local_view(v.dot(point.fibre), v.dot(across), v.dot(normal));
    f += V3f(curve.gloss.weight * gloss_reflectance(local_light, local_view, curve.gloss.roughness));
  }
  // No step where the light sets.
  return f * (cosine * std::min(1.0F, light.z / min_rise));
}

LightTransfer Yarns::transfer_at(const YarnPoint& point, bool through) const {
  const std::vector<float>& light = through ? data_.through : data_.light;
  if (light.empty()) return {};
  const YarnCurve& curve = data_.curves[point.curve];
  const auto whole = static_cast<int>(point.station);
  const float share = point.station - static_cast<float>(whole);
  const auto coefficients = [&](int station) {
    return &light[std::size_t{light_values_per_station} *
                  (first_station_[point.curve] + station % curve.stations)];
  };
  const float* here = coefficients(whole);
  const float* next = coefficients(whole + 1);
  LightTransfer transfer{};
  for (const float a : angle_basis(point.cosine, point.sine)) {
    for (std::size_t i = 0; i < transfer.size(); ++i)
      transfer[i] += a * (here[i] * (1 - share) + next[i] * share);
    here += transfer.size();
    next += transfer.size();
  }
  return transfer;
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

Shading Yarns::shade(const V2d& uv, float plane, const V3f& light, const V3f& view) const {
  const auto hit = trace(uv, plane, view);
  Shading shading;
  if (!hit) return shading;
  shading.alpha = 1;
  if (light.z == 0 || !(view.z > 0)) return shading;
  YarnPoint point = point_at(*hit);
  add_strands(point, view);
  if (light.z < 0) {
    shading.radiance = indirect_light(transfer_at(point, true), mirrored(light)) * point.brightness;
    return shading;
  }
  shading.radiance = indirect_light(transfer_at(point), light) * point.brightness;
  const V3f lit = direct(point, light, view);
  if (lit != V3f(0, 0, 0) && !occluded(*hit, point, light)) shading.radiance += lit;
  return shading;
}

}  // namespace selvedge
