// The segments of yarn, or of the plies that follow from its axis (spec/brdf.md, "Curves" and "Plies").
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "format/fabric/yarns.h"

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

/// The direction at node i of those from one before the first to one behind the last.
V3d tangent_at(std::span<const V3d> nodes, int i) {
  const V3d before = nodes[i + 1] - nodes[i];
  const V3d after = nodes[i + 2] - nodes[i + 1];
  const V3d sum = before * after.length2() + after * before.length2();
  // A chain that turns straight back has no tangent there.
  return sum.length2() > 0 ? sum.normalized() : after.normalized();
}

/// The axis of a yarn: its nodes with one before and two behind them, and per node what follows from them.
struct Axis {
  std::vector<V3d> nodes, tangent, across;
  std::vector<double> length;  ///< up to the node, by straight lines
  V3d turns;
};

Axis axis_of(const YarnCurve& curve, std::span<const V3f> nodes, const V2f& period) {
  const int count = curve.nodes;
  Axis axis;
  axis.turns = V3d(curve.repeat_offset.x * static_cast<double>(period.x),
                   curve.repeat_offset.y * static_cast<double>(period.y), 0);
  for (int i = -1; i <= count + 1; ++i) {
    const int repeat = i < 0 ? -1 : i / count;
    axis.nodes.push_back(V3d(nodes[i - repeat * count]) + axis.turns * static_cast<double>(repeat));
  }
  for (int i = 0; i <= count; ++i) axis.tangent.push_back(tangent_at(axis.nodes, i));
  const V3d& tangent = axis.tangent[0];
  const V3d upright = angles_from_x_axis(V3f(tangent)) ? V3d(1, 0, 0) : V3d(0, 0, 1);
  axis.across.push_back((upright - tangent * upright.dot(tangent)).normalized());
  axis.length.push_back(0);
  for (int i = 0; i < count; ++i) {
    const V3d way = axis.nodes[i + 2] - axis.nodes[i + 1];
    axis.across.push_back(carried(axis.across[i], way, axis.tangent[i], axis.tangent[i + 1]));
    axis.length.push_back(axis.length[i] + way.length());
  }
  const double turned = std::atan2(axis.across[0].cross(axis.across[count]).dot(axis.tangent[0]),
                                   axis.across[0].dot(axis.across[count]));
  for (int i = 0; i <= count; ++i) {
    const double angle = -turned * axis.length[i] / axis.length[count];
    axis.across[i] =
        axis.across[i] * std::cos(angle) + axis.tangent[i].cross(axis.across[i]) * std::sin(angle);
  }
  return axis;
}

/// A place of the axis where its plies have nodes.
struct AxisPlace {
  V3d position, across, beside;  ///< both unit, perpendicular to the axis
  double fraction = 0;           ///< of the chain's length
  V3d squeeze{0, 0, 0};
};

/// Squeeze of a squashed curve, at a fraction of segment i.
V3d squeeze_at(const YarnCurve& curve, int i, double fraction) {
  return squeeze_between(V3d(curve.squeezes[i]), V3d(curve.squeezes[(i + 1) % curve.nodes]), fraction);
}

/// Place k of the divisions on segment i.
AxisPlace place_on(const Axis& axis, const YarnCurve& curve, int i, int k) {
  const double s = static_cast<double>(k) / curve.plies.divisions;
  const double rest = 1 - s;
  const V3d along = axis.nodes[i + 2] - axis.nodes[i + 1];
  const double length = along.length();
  const V3d first = axis.tangent[i] * length;
  const V3d second = axis.tangent[i + 1] * length;
  const V3d slope = along * (6 * s * rest) + first * (rest * (1 - 3 * s)) + second * (s * (3 * s - 2));
  const V3d tangent = slope.length2() > 0 ? slope.normalized() : axis.tangent[i];
  const V3d across = axis.across[i] * rest + axis.across[i + 1] * s;
  AxisPlace place;
  place.position =
      axis.nodes[i + 1] + along * (s * s * (3 - 2 * s)) + first * (s * rest * rest) - second * (s * s * rest);
  place.across = (across - tangent * tangent.dot(across)).normalized();
  place.beside = tangent.cross(place.across);
  if (!curve.squeezes.empty())
    place.squeeze = squeeze_at(curve, i, s);
  else if (!curve.is_round())
    place.squeeze = squeeze_of(static_cast<double>(curve.flattening), tangent);
  place.fraction = (axis.length[i] + s * length) / axis.length.back();
  return place;
}

/// The ends of a ply's or yarn's segments.
struct ChainNodes {
  std::vector<V3d> nodes;  ///< with one before and two behind them
  std::vector<V3d> across, out;
  std::vector<double> fraction;
  std::vector<V3d> squeeze;  ///< of the segments
  StrandRows rows;
};

/// Squeeze for the part of the axis from one place to another.
V3d squeeze_along(const YarnCurve& curve, const V3d& from, const V3d& to) {
  const V3d way = to - from;
  if (curve.is_round() || way.length2() == 0) return {0, 0, 0};
  return squeeze_of(static_cast<double>(curve.flattening), way.normalized());
}

/// Radius of the circle with the area of its section.
float round_radius_of(const Yarns::Segment& s) { return s.radius / round_section_radius(1.0F, s.squeeze); }

void append_segments(const ChainNodes& chain, const YarnCurve& curve, std::vector<Yarns::Segment>& segments) {
  const auto count = static_cast<int>(chain.nodes.size()) - 3;
  V3f tangent(tangent_at(chain.nodes, 0));
  for (int i = 0; i < count; ++i) {
    Yarns::Segment s;
    s.start = V3f(chain.nodes[i + 1]);
    s.along = V3f(chain.nodes[i + 2] - chain.nodes[i + 1]);
    s.tangent[0] = tangent;
    s.tangent[1] = tangent = V3f(tangent_at(chain.nodes, i + 1));
    s.across = {V3f(chain.across[i]), V3f(chain.across[i + 1])};
    if (!chain.out.empty()) s.axis_to_ply = {V3f(chain.out[i]), V3f(chain.out[i + 1])};
    s.squeeze = V3f(chain.squeeze[i]);
    s.inverse_length2 = 1 / squeezed(s.along, s.squeeze).length2();
    s.start_station = static_cast<float>(chain.fraction[i] * curve.stations);
    s.station_span = static_cast<float>((chain.fraction[i + 1] - chain.fraction[i]) * curve.stations);
    const double round_radius =
        static_cast<double>(ply_or_yarn_radius(curve)) *
        strand_swell(curve.strands, (chain.fraction[i] + chain.fraction[i + 1]) / 2, thickness_noise_byte);
    s.radius = static_cast<float>(round_section_radius(round_radius, chain.squeeze[i]));
    s.rows = chain.rows;
    segments.push_back(s);
  }
  // All plies are as thick at a place: so is that which this one runs on from.
  float before = round_radius_of(segments.back());
  for (auto s = segments.end() - count; s != segments.end(); ++s) {
    const float own = round_radius_of(*s);
    s->bounding_radius = before > own ? round_section_radius(before, s->squeeze) : s->radius;
    before = own;
  }
}

/// Calls visit(chain) for the plies until one returns false; whether none did.
template <class Visit>
bool visit_plies(const Axis& axis, const YarnCurve& curve, const Visit& visit) {
  const int plies = curve.plies.count;
  const int divisions = curve.plies.divisions;
  const int shift = curve.plies.shift;
  const auto phase = static_cast<double>(curve.plies.phase);
  const int count = curve.nodes * divisions;
  std::vector<AxisPlace> places;
  places.reserve(count);
  for (int i = 0; i < count; ++i) places.push_back(place_on(axis, curve, i / divisions, i % divisions));
  const double offset = static_cast<double>(curve.radius) * (1 - unit_ply_radius(plies));
  ChainNodes chain;
  for (int ply = 0; ply < plies; ++ply) {
    for (auto* list : {&chain.nodes, &chain.across, &chain.out, &chain.squeeze}) list->clear();
    chain.fraction.clear();
    chain.rows = ply_strand_rows(curve, ply);
    V3d before(0, 0, 0);
    for (int i = -1; i <= count + 1; ++i) {
      const int repeat = i < 0 ? -1 : i / count;
      const AxisPlace& place = places[i - repeat * count];
      const double fraction = place.fraction + repeat;
      const double angle = phase + 2 * std::numbers::pi * (ply + shift * fraction) / plies;
      const V3d out = place.across * std::cos(angle) + place.beside * std::sin(angle);
      const double orbit = offset * strand_swell(curve.strands, fraction, thickness_noise_byte);
      const V3d middle = place.position + axis.turns * static_cast<double>(repeat);
      chain.nodes.push_back(middle +
                            stretched(out, place.squeeze) * round_section_radius(orbit, place.squeeze));
      if (i > 0 && i <= count)
        chain.squeeze.push_back(curve.squeezes.empty()
                                    ? squeeze_along(curve, before, middle)
                                    : squeeze_between(places[i - 1].squeeze, places[i % count].squeeze, 0.5));
      before = middle;
      if (i < 0 || i > count) continue;
      chain.across.push_back(place.across);
      chain.out.push_back(out);
      chain.fraction.push_back(fraction);
    }
    if (!visit(chain)) return false;
  }
  return true;
}

V3f across_of(const V3f& d, const V3f& unit_axis) {
  const V3f across = d - unit_axis * unit_axis.dot(d);
  return across.length2() > 0 ? across.normalized() : across;
}

}  // namespace

double unit_ply_radius(int plies) {
  const double sine = std::sin(std::numbers::pi / plies);
  return plies == 1 ? 1 : sine / (1 + sine);
}

float ply_or_yarn_radius(const YarnCurve& curve) {
  return static_cast<float>(static_cast<double>(curve.radius) * unit_ply_radius(curve.plies.count));
}

std::vector<Yarns::Segment> make_segments(const YarnCurve& curve, std::span<const V3f> nodes,
                                          const V2f& period) {
  std::vector<Yarns::Segment> segments;
  segments.reserve(segment_count(curve));
  append_segments_of(curve, nodes, period, segments);
  return segments;
}

void append_segments_of(const YarnCurve& curve, std::span<const V3f> nodes, const V2f& period,
                        std::vector<Yarns::Segment>& segments) {
  const Axis axis = axis_of(curve, nodes, period);
  if (curve.plies.count > 1) {
    visit_plies(axis, curve, [&](const ChainNodes& chain) {
      append_segments(chain, curve, segments);
      return true;
    });
  } else {
    ChainNodes chain{axis.nodes, axis.across, {}, axis.length, {}, {}};
    for (int i = 0; i < curve.nodes; ++i)
      chain.squeeze.push_back(curve.squeezes.empty()
                                  ? squeeze_along(curve, axis.nodes[i + 1], axis.nodes[i + 2])
                                  : squeeze_at(curve, i, 0.5));
    for (double& fraction : chain.fraction) fraction /= axis.length.back();
    append_segments(chain, curve, segments);
  }
}

bool holds_for_plies(const YarnCurve& curve, std::span<const V3f> nodes, const V2f& period,
                     const std::function<bool(std::span<const V3d>)>& test) {
  return visit_plies(axis_of(curve, nodes, period), curve, [&](const ChainNodes& chain) {
    return test(std::span(chain.nodes).subspan(1, chain.nodes.size() - 2));
  });
}

StrandRows ply_strand_rows(const YarnCurve& curve, int ply) {
  // Yarn turned over counts its plies the other way round; its strands know what it was.
  const int sense = curve.strands.count < 0 ? -1 : 1;
  const auto row = [&](int number) {
    const int within = sense * number % curve.plies.count;
    return std::abs(curve.strands.count) * (within < 0 ? within + curve.plies.count : within);
  };
  return {row(ply), row(ply + curve.plies.shift), curve.plies.count};
}

bool angles_from_x_axis(const YarnCurve& curve, std::span<const V3f> nodes, const V2f& period) {
  return angles_from_x_axis(V3f(axis_of(curve, nodes, period).tangent[0]));
}

std::vector<int> stitches_of(const YarnMap& map, const V2f& period, const YarnCurve& curve,
                             std::span<const V3f> nodes) {
  constexpr float near = 1e-3F;  // of a stitch
  std::vector<int> stitches(nodes.size(), 0);
  if (map.empty()) return stitches;
  const int along = curve.repeat_offset.x == 0 ? 1 : 0;
  const int count = map.kinds[along];
  const int sense = curve.repeat_offset[along] < 0 ? -1 : 1;
  const auto at = [&](std::size_t i) {
    return nodes[i][along] / period[along] * static_cast<float>(sense * count);
  };
  std::size_t first = 0;
  while (first + 1 < nodes.size() && std::abs(at(first) - std::round(at(first))) > near) ++first;
  auto border = static_cast<int>(std::round(at(first)));  // the next one
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (i >= first && std::abs(at(i) - static_cast<float>(border)) < near) ++border;
    const int stitch = (sense > 0 ? border - 1 : -border) % count;
    stitches[i] = stitch < 0 ? stitch + count : stitch;
  }
  return stitches;
}

void append_stitches(const YarnData& data, std::size_t number, std::span<const V3f> nodes, const V2f& period,
                     std::span<Yarns::Segment> segments, std::vector<V2i>& stitches) {
  const YarnMap& map = data.map;
  const YarnCurve& curve = data.curves[number];
  const int along = curve.repeat_offset.x == 0 ? 1 : 0;
  const int line = along == 0 ? map.kinds.y - 1 - map.lines[number] : map.lines[number];
  const std::vector<int> of_nodes = stitches_of(map, period, curve, nodes);
  for (std::size_t i = 0; i < segments.size(); ++i) {
    Yarns::Segment& s = segments[i];
    const bool is_hair = s.hair_threshold > 0;
    const bool is_in_line = !is_hair && curve.repeat_offset != V2i(0, 0);
    V2i& stitch = stitches.emplace_back();
    for (int axis = 0; axis < 2; ++axis) {
      const auto count = static_cast<float>(map.kinds[axis]);
      const float middle = (s.start[axis] + s.along[axis] / 2) / period[axis] * count;
      stitch[axis] = static_cast<int>(std::floor(middle));
      if (is_hair) {
        const float repeats = std::floor(middle / count);
        stitch[axis] -= map.kinds[axis] * static_cast<int>(repeats);
        s.start[axis] -= repeats * period[axis];
      }
      if (!is_in_line) continue;
      // It may bulge over its line and its borders, by less than half the repeat.
      const int kind = axis == along ? of_nodes[i / curve.plies.divisions % nodes.size()] : line;
      const float repeats = std::round((middle - 0.5F - static_cast<float>(kind)) / count);
      stitch[axis] = kind + map.kinds[axis] * static_cast<int>(repeats);
    }
  }
}

void Yarns::derive_segments() const {
  Derived& all = *derived_;
  all.low = std::numeric_limits<float>::max();
  all.high = std::numeric_limits<float>::lowest();
  all.segments.reserve(piece_count(data_));
  for_each_curve(data_, [&](std::size_t c, const YarnCurve& curve, std::span<const V3f> nodes) {
    const std::size_t first = all.segments.size();
    all.first_segment.push_back(static_cast<int>(first));
    append_segments_with_hairs(curve, nodes, period_, all.segments);
    const auto own = std::span(all.segments).subspan(first);
    if (!data_.map.empty()) append_stitches(data_, c, nodes, period_, own, all.stitches);
    for (Segment& s : own) {
      s.curve = static_cast<int>(c);
      // Chains end where others begin, hairs do not.
      const float to = s.hair_threshold > 0 ? s.start.z + s.along.z : s.start.z;
      all.low = std::min(all.low, std::min(s.start.z, to) - s.half_height());
      all.high = std::max(all.high, std::max(s.start.z, to) + s.half_height());
    }
    const bool sideways = angles_from_x_axis(curve, nodes, period_);
    all.strand_sense.push_back(curve.strands.count >= 0 ? V2f(1, 1) : sideways ? V2f(1, -1) : V2f(-1, 1));
  });
}

YarnFrame Yarns::frame_at(int curve, int station, int ply) const {
  const auto at = static_cast<float>(station);
  const YarnPlies& plies = data_.curves[curve].plies;
  const int count = data_.curves[curve].nodes * plies.divisions;
  const Segment* const first = &geometry().segments[derived_->first_segment[curve] + ply * count];
  const auto i = std::partition_point(first + 1, first + count,
                                      [&](const Segment& s) { return s.start_station <= at; }) -
                 first - 1;
  const Segment& s = first[i];
  const float fraction = std::clamp((at - s.start_station) / s.station_span, 0.0F, 1.0F);
  YarnFrame frame;
  frame.position = s.start + s.along * fraction;
  frame.tangent = squeezed(mix(s.tangent[0], s.tangent[1], fraction), s.squeeze).normalized();
  frame.across = across_of(mix(s.across[0], s.across[1], fraction), frame.tangent);
  frame.axis_to_ply = across_of(mix(s.axis_to_ply[0], s.axis_to_ply[1], fraction), frame.tangent);
  frame.squeeze = s.squeeze;
  const Segment& next = first[(i + 1) % count];
  frame.radius = std::max(
      s.bounding_radius,
      round_section_radius(next.bounding_radius / round_section_radius(1.0F, next.squeeze), s.squeeze));
  return frame;
}

std::vector<StationPoint> points_around_station(const Yarns& yarns, int curve, int station, int count) {
  const YarnPlies& plies = yarns.data().curves[curve].plies;
  constexpr float pi = std::numbers::pi_v<float>;
  // Plies touch their neighbours so far from their outermost line; what lies beyond is inside of the yarn.
  const float reach = plies.count == 1 ? pi : pi / 2 + pi / static_cast<float>(plies.count);
  std::vector<StationPoint> points;
  for (int ply = 0; ply < plies.count; ++ply) {
    const YarnFrame frame = yarns.frame_at(curve, station, ply);
    const V3f& from = plies.count == 1 ? frame.across : frame.axis_to_ply;
    const V3f beside = frame.tangent.cross(frame.across);
    for (int i = 0; i < count; ++i) {
      const float angle = reach * (2 * (static_cast<float>(i) + 0.5F) / static_cast<float>(count) - 1);
      const V3f round = from * std::cos(angle) + frame.tangent.cross(from) * std::sin(angle);
      YarnPoint at;
      at.angle_cosine = round.dot(frame.across);
      at.angle_sine = round.dot(beside);
      at.ply_side = {frame.axis_to_ply.dot(frame.across), frame.axis_to_ply.dot(beside)};
      StationPoint& point = points.emplace_back();
      point.position = frame.surface_position(round);
      point.normal = frame.surface_normal(round);
      point.radius = frame.radius;
      if (plies.count > 1)
        point.visible_fraction = (std::cos(angle) - std::cos(reach)) / (1 - std::cos(reach));
      point.functions = angle_factors(plies, at);
    }
  }
  return points;
}

}  // namespace selvedge
