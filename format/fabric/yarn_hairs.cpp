#include "format/fabric/yarn_hairs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "format/fabric/yarns.h"

namespace selvedge {
namespace {

using std::numbers::pi;

constexpr int pieces = hair_point_count - 1;
/// The meaning of the numbers of a hair; their places in its formula.
enum Drawn { at_fraction, at_ply, at_angle, of_length, of_loop, a, b, c, d, e, f };

/// Number k of a hair, in (0, 1).
double number(std::uint32_t hashed_seed, int hair, Drawn k) {
  const std::uint32_t place = 0x80000000U + 16U * static_cast<std::uint32_t>(hair) + k;
  return ((hash32(hashed_seed ^ place) >> 8U) + 0.5) * 0x1p-24;
}

/// The point of a chain's segment at a fraction of it, seen from its start, and the direction there: of
/// the round section.
struct OnChain {
  V3d off, tangent;
};

OnChain on_chain(const Yarns::Segment& s, double fraction) {
  const V3d squeeze(s.squeeze);
  const V3d along = squeezed(V3d(s.along), squeeze);
  const double rest = 1 - fraction;
  const V3d first = squeezed(V3d(s.tangent[0]), squeeze) * along.length();
  const V3d second = squeezed(V3d(s.tangent[1]), squeeze) * along.length();
  return {along * (fraction * fraction * (3 - 2 * fraction)) + first * (fraction * rest * rest) -
              second * (fraction * fraction * rest),
          (along * (6 * fraction * rest) + first * (rest * (1 - 3 * fraction)) +
           second * (fraction * (3 * fraction - 2)))
              .normalized()};
}

V3d mix(const std::array<V3f, 2>& ends, double fraction) {
  return V3d(ends[0]) * (1 - fraction) + V3d(ends[1]) * fraction;
}

}  // namespace

std::array<V3d, hair_point_count> hair_points(const YarnHairs& hairs, std::uint32_t hashed_seed, int hair) {
  const auto drawn = [&](Drawn k) { return number(hashed_seed, hair, k); };
  const double length = -static_cast<double>(hairs.mean_length) *
                        std::log1p(drawn(of_length) * std::expm1(-max_hair_length_ratio));
  std::array<V3d, hair_point_count> points;
  points.fill(V3d(0, 0, 0));
  if (drawn(of_loop) < static_cast<double>(hairs.loop_fraction)) {
    // A bow with both ends on the surface: half an ellipse of this width and height is about as long.
    const double lean = (drawn(a) - 0.5) * pi / 2;
    const double width = length * (0.3 + 0.2 * drawn(b));
    const double height = 0.4 * std::sqrt(length * length - width * width);
    for (int k = 1; k <= pieces; ++k) {
      const double angle = pi * k / pieces;
      const double up = height * std::sin(angle);
      points[k] = {0.5 * width * (1 - std::cos(angle)), up * std::sin(lean), up * std::cos(lean)};
    }
    return points;
  }
  // A free end leaves at a slant, mostly along the fibres, either way, and bends in a plane.
  const double slant = (15 + 55 * drawn(a)) * pi / 180;  // from the normal
  const double azimuth = 0.5 * pi * (drawn(b) + drawn(c) - 1) + (drawn(d) < 0.5 ? pi : 0);
  const double plane = 2 * pi * drawn(e);
  const double turn = (0.3 + 1.5 * drawn(f)) / pieces;
  const V3d level(std::cos(azimuth), std::sin(azimuth), 0);
  const V3d way = level * std::sin(slant) + V3d(0, 0, std::cos(slant));
  const V3d bend = (level * std::cos(slant) - V3d(0, 0, std::sin(slant))) * std::cos(plane) +
                   V3d(-level.y, level.x, 0) * std::sin(plane);
  for (int k = 1; k <= pieces; ++k)
    points[k] = points[k - 1] + (way * std::cos(k * turn) + bend * std::sin(k * turn)) * (length / pieces);
  return points;
}

std::vector<YarnHair> make_hairs(const YarnCurve& curve, std::span<const V3f> nodes, const V2f& period,
                                 std::span<const Yarns::Segment> chain) {
  std::vector<YarnHair> hairs;
  const int count = std::abs(curve.hairs.count);
  if (count == 0) return hairs;
  const int plies = curve.plies.count;
  const std::size_t each = chain.size() / plies;
  const std::uint32_t seed = hash32(static_cast<std::uint32_t>(curve.strands.seed));
  // Yarn turned over has the hairs that it had, in a mirror: its plies count the other way round, and angles
  // count from the mirrored direction.
  const bool over = curve.hairs.count < 0;
  const bool sideways = over && angles_from_x_axis(curve, nodes, period);
  const V2d sense(over && !sideways ? -1 : 1, over && sideways ? -1 : 1);
  hairs.reserve(count);
  for (int h = 0; h < count; ++h) {
    const double fraction = number(seed, h, at_fraction);
    const int drawn = static_cast<int>(plies * number(seed, h, at_ply));
    const auto own = chain.subspan(each * (over ? (plies - drawn) % plies : drawn), each);
    const double station = fraction * curve.stations;
    const auto next = std::upper_bound(
        own.begin() + 1, own.end(), station,
        [](double at, const Yarns::Segment& s) { return at < static_cast<double>(s.start_station); });
    const Yarns::Segment& s = *(next - 1);
    const double part = std::clamp(
        (station - static_cast<double>(s.start_station)) / static_cast<double>(s.station_span), 0.0, 1.0);
    const auto [off, tangent] = on_chain(s, part);
    const double angle = 2 * pi * number(seed, h, at_angle);
    const V2d turned(sense.x * std::cos(angle), sense.y * std::sin(angle));
    V3d across = mix(s.across, part);
    across = (across - tangent * tangent.dot(across)).normalized();
    YarnHair hair;
    const V3d round = across * turned.x + tangent.cross(across) * turned.y;
    const V3d squeeze(s.squeeze);
    hair.normal = squeezed(round, squeeze).normalized();
    hair.station = static_cast<float>(station);
    const V3d out = mix(s.axis_to_ply, part);
    hair.root_angle = V3f(V3d(turned.x, turned.y, round.dot(out)));
    hair.ply_side = V2f(V2d(out.dot(across), out.dot(tangent.cross(across))));
    const V3d fibre =
        stretched(tangent + tangent.cross(round) * static_cast<double>(curve.fibre_slope), squeeze)
            .normalized();
    const V3d beside = hair.normal.cross(fibre) * (sense.x * sense.y);
    const double radius = static_cast<double>(ply_or_yarn_radius(curve)) *
                          strand_swell(curve.strands, fraction, thickness_noise_byte);
    const V3d root = V3d(s.start) + stretched(off + round * round_section_radius(radius, squeeze), squeeze);
    const auto shape = hair_points(curve.hairs, seed, h);
    for (int k = 0; k < hair_point_count; ++k)
      hair.points[k] = root + fibre * shape[k].x + beside * shape[k].y + hair.normal * shape[k].z;
    hairs.push_back(hair);
  }
  return hairs;
}

void append_segments_with_hairs(const YarnCurve& curve, std::span<const V3f> nodes, const V2f& period,
                                std::vector<Yarns::Segment>& segments) {
  const std::size_t first = segments.size();
  append_segments_of(curve, nodes, period, segments);
  const std::vector<YarnHair> hairs = make_hairs(curve, nodes, period, std::span(segments).subspan(first));
  const float radius = curve.hairs.radius * curve.hairs.opacity;
  for (std::size_t h = 0; h < hairs.size(); ++h) {
    for (int k = 0; k < pieces; ++k) {
      Yarns::Segment s;
      s.start = V3f(hairs[h].points[k]);
      s.along = V3f(hairs[h].points[k + 1] - hairs[h].points[k]);
      // A piece without a direction in single precision cannot be met.
      if (!std::isfinite(1 / s.along.length2())) continue;
      s.tangent.fill(s.along.normalized());
      s.across = {hairs[h].root_angle, V3f(hairs[h].ply_side.x, hairs[h].ply_side.y, 0)};
      s.inverse_length2 = 1 / s.along.length2();
      s.start_station = hairs[h].station;
      s.radius = radius;
      s.bounding_radius = std::max(radius, max_hair_radius_ratio * curve.radius);
      s.hair_threshold = (static_cast<float>(h) + 0.5F) / static_cast<float>(hairs.size());
      segments.push_back(s);
    }
  }
}

float min_empty_width(const Yarns::Segment& s) {
  const bool vanishes = s.hair_threshold > 0 && s.hair_threshold * s.bounding_radius >= s.radius;
  return vanishes ? 2 * s.radius / s.hair_threshold : std::numeric_limits<float>::infinity();
}

}  // namespace selvedge
