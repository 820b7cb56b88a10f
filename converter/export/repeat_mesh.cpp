#include "converter/export/repeat_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>
#include <tuple>
#include <utility>

#include "converter/export/yarn_lighting.h"
#include "format/base/parallel.h"

namespace selvedge {
namespace {

constexpr double pi = std::numbers::pi;
constexpr int min_sides = 4, full_sides = 12, min_rings = 4;
constexpr int min_sides_of_ply = 4, full_sides_of_ply = 8;

/// The segments of a yarn or ply, which follow each other, and how far it bends along them.
struct Chain {
  std::vector<Yarns::Segment> segments;
  Yarns::Segment next;       ///< follows them
  std::vector<double> bend;  ///< up to each node: the integral of the root of the curvature
  double length = 0;         ///< mm

  /// The last one follows the chain.
  explicit Chain(std::vector<Yarns::Segment> chain)
      : segments(std::move(chain)), next(segments.back()), bend{0} {
    segments.pop_back();
    std::vector<double> lengths{0};
    for (const Yarns::Segment& s : segments) {
      const auto own = static_cast<double>(s.along.length());
      const double cosine = std::clamp(static_cast<double>(s.tangent[0].dot(s.tangent[1])), -1.0, 1.0);
      lengths.push_back(length += own);
      bend.push_back(bend.back() + std::sqrt(std::acos(cosine) * own));
    }
    // Light changes along straight yarn as well: half of the rings are spread evenly.
    const double even = std::max(bend.back(), 1e-9 * length) / length;
    for (std::size_t i = 0; i < bend.size(); ++i) bend[i] += even * lengths[i];
  }
  /// How much it bends, in roots of its radii.
  double winding() const {
    const Yarns::Segment& s = segments.front();
    return bend.back() / 2 / std::sqrt(static_cast<double>(s.radius / round_section_radius(1.0F, s.squeeze)));
  }
};

/// A place on a chain.
struct ChainPlace {
  std::size_t segment = 0;
  float fraction = 0;
  YarnFrame frame;
  V3f round_at(double angle) const {
    return frame.across * static_cast<float>(std::cos(angle)) +
           frame.tangent.cross(frame.across) * static_cast<float>(std::sin(angle));
  }
};

/// The place that this fraction of the chain's bends leads to; on the smooth curve through its nodes.
ChainPlace place_at(const Chain& chain, double fraction) {
  const double wanted = fraction * chain.bend.back();
  const auto next = std::upper_bound(chain.bend.begin() + 1, chain.bend.end() - 1, wanted);
  ChainPlace place;
  place.segment = static_cast<std::size_t>(next - chain.bend.begin()) - 1;
  const double from = chain.bend[place.segment];
  const auto t = static_cast<float>(std::clamp((wanted - from) / (*next - from), 0.0, 1.0));
  const Yarns::Segment& s = chain.segments[place.segment];
  const float rest = 1 - t, length = s.along.length();
  const V3f first = s.tangent[0] * length, second = s.tangent[1] * length;
  const V3f way = s.along * (6 * t * rest) + first * (rest * (1 - 3 * t)) + second * (t * (3 * t - 2));
  place.fraction = t;
  YarnFrame& frame = place.frame;
  frame.position =
      s.start + s.along * (t * t * (3 - 2 * t)) + first * (t * rest * rest) - second * (t * t * rest);
  // The chain's end is as thick as what follows.
  const Yarns::Segment& section = fraction < 1 ? s : chain.next;
  frame.squeeze = section.squeeze;
  frame.radius = section.radius;
  frame.tangent = squeezed(way, frame.squeeze).normalized();
  const V3f across = mix(s.across[0], s.across[1], t);
  frame.across = (across - frame.tangent * frame.tangent.dot(across)).normalized();
  return place;
}

/// Hairs are not drawn, and would hide light as if they were all as thick as they are. A map's stitches have
/// their light where they are made.
Yarns bare_yarns(const Yarns& yarns) {
  YarnData data = yarns.data();
  data.map = {};
  for (YarnCurve& curve : data.curves) curve.hairs.count = 0;
  return {std::move(data), yarns.period()};
}

/// A corner of a tube's section.
struct SectionCorner {
  double angle = 0;  ///< about the axis
  float reach = 1;   ///< in radii
};

/// The axis of a curve, or of its part in a stitch of a map, and the plies about it.
class PliedCurve {
 public:
  Chain axis;
  int number;  ///< of the curve
  int stitch;  ///< of the map; 0 without

  /// `begin`: the node of the curve where the axis begins.
  PliedCurve(const Yarns& yarns, int curve, int in_stitch, Chain chain, int first_segment, int begin)
      : axis(std::move(chain)),
        number(curve),
        stitch(in_stitch),
        begin_(begin),
        nodes_(yarns.data().curves[curve].nodes),
        plies_(yarns.data().curves[curve].plies),
        radius_(static_cast<float>(unit_ply_radius(plies_.count))),
        first_segment_(first_segment),
        segments_(yarns.geometry().segments) {}

  int plies() const { return plies_.count; }
  bool is_part() const { return axis.segments.size() < nodes_; }
  /// Radians, of the plies about the axis along it.
  double twist() const {
    return 2 * pi * plies_.shift / plies_.count * static_cast<double>(axis.segments.size()) /
           static_cast<double>(nodes_);
  }

  /// The angle of the first ply about the axis; it continues beyond pi.
  double turn_at(const ChainPlace& place) const {
    if (plies_.count == 1) return 0;
    const auto [segment, fraction] = ply_at(0, place);
    const V3f out = mix(segment->axis_to_ply[0], segment->axis_to_ply[1], fraction);
    const double turn =
        std::atan2(out.dot(place.frame.tangent.cross(place.frame.across)), out.dot(place.frame.across));
    const double near =
        static_cast<double>(plies_.phase) +
        twist() * (static_cast<double>(begin_ + place.segment) + static_cast<double>(place.fraction)) /
            static_cast<double>(axis.segments.size());
    return near + std::remainder(turn - near, 2 * pi);
  }

  /// How far the plies reach from the axis at an angle from one of them, in radii of the yarn.
  float reach_at(float cosine) const {
    const float away = 1 - radius_;
    return away * cosine + std::sqrt(std::max(0.0F, radius_ * radius_ - away * away * (1 - cosine * cosine)));
  }

  /// One of `corners` corners from where a ply meets the one before it to where it meets the next; the angle
  /// is from the first ply.
  SectionCorner corner_of(int ply, int corner, int corners) const {
    const double between = pi / plies_.count, half = pi / 2 + between, side = half / corners;
    if (corner == 0)
      return {2 * between * ply - between, static_cast<float>((1 - double{radius_}) * std::cos(between))};
    const double about = 2 * side * corner - half, wide = radius_ * side / std::sin(side);
    const double x = 1 - radius_ + wide * std::cos(about), y = wide * std::sin(about);
    return {2 * between * ply + std::atan2(y, x), static_cast<float>(std::hypot(x, y))};
  }

  /// The plies' surface at an angle about the axis.
  YarnHit hit_at(const ChainPlace& place, double angle) const {
    const V3f round = place.round_at(angle);
    int facing = 0;
    float most = -1;
    for (int ply = 0; ply < plies_.count; ++ply) {
      const auto [segment, fraction] = ply_at(ply, place);
      const float cosine = mix(segment->axis_to_ply[0], segment->axis_to_ply[1], fraction).dot(round);
      if (cosine > most) std::tie(facing, most) = std::pair(ply, cosine);
    }
    const auto [segment, fraction] = ply_at(facing, place);
    const Yarns::Segment& s = *segment;
    const V3f way = squeezed(s.along, s.squeeze) * std::sqrt(s.inverse_length2);
    V3f across = round * reach_at(most) - mix(s.axis_to_ply[0], s.axis_to_ply[1], fraction) * (1 - radius_);
    across = (across - way * way.dot(across)).normalized();
    return {static_cast<int>(segment - segments_.data()),
            s.along * fraction + stretched(across, s.squeeze) * s.radius};
  }

 private:
  std::pair<const Yarns::Segment*, float> ply_at(int ply, const ChainPlace& place) const {
    const std::size_t divisions = plies_.divisions;
    const float part = place.fraction * static_cast<float>(divisions);
    const auto within = std::min(divisions - 1, static_cast<std::size_t>(part));
    const std::size_t node = ply * nodes_ + (begin_ + place.segment) % nodes_;
    const std::size_t segment = node * divisions + within;
    return {&segments_[first_segment_ + segment], part - static_cast<float>(within)};
  }

  std::size_t begin_, nodes_;
  YarnPlies plies_;
  float radius_;  ///< of a ply, in radii of the yarn
  std::size_t first_segment_;
  std::span<const Yarns::Segment> segments_;
};

/// The segments of a curve from the node `begin` on that lie in a stitch, in its frame.
PliedCurve part_of(const Yarns& yarns, const YarnMap& map, int curve, std::span<const Yarns::Segment> all,
                   int along, int begin, int count, int first_segment) {
  const V2i& turns = yarns.data().curves[curve].repeat_offset;
  std::vector<Yarns::Segment> segments;
  for (int i = begin; i <= begin + count; ++i) {
    const V2f shift = V2f(turns * (i / static_cast<int>(all.size()))) * yarns.period();
    segments.push_back(all[i % all.size()]);
    segments.back().start += V3f(shift.x, shift.y, 0);
  }
  const V3f middle = (segments.front().start + segments.back().start) / 2;
  const int line = map.empty() ? 0 : map.kinds.y - 1 - map.lines[curve];
  const V2i place = turns.x == 0 ? V2i(map.kinds.y - 1 - line, along) : V2i(along, line);
  for (int axis = 0; axis < 2 && !map.empty(); ++axis) {
    const auto kinds = static_cast<float>(map.kinds[axis]);
    const float cell = yarns.period()[axis] / kinds, at = static_cast<float>(place[axis]);
    const float repeats = std::round((middle[axis] / cell - at - 0.5F) / kinds);
    const float origin = (at + static_cast<float>(axis) + repeats * kinds) * cell;
    for (Yarns::Segment& s : segments) s.start[axis] -= origin;
  }
  return {yarns,           curve,         (map.kinds.y - 1 - place.y) * map.kinds.x + place.x,
          Chain(segments), first_segment, begin};
}

/// The curves, or their parts in the stitches that a map shows. Precondition: bare_yarns().
std::vector<PliedCurve> curves_of(const Yarns& yarns, const YarnMap& map) {
  const std::set<int> shown(map.shown.begin(), map.shown.end());
  std::vector<PliedCurve> curves;
  int first = 0;
  for_each_curve(yarns.data(), [&](std::size_t c, const YarnCurve& curve, std::span<const V3f> nodes) {
    YarnCurve bare = curve;
    bare.plies = {};
    const std::vector<Yarns::Segment> all = make_segments(bare, nodes, yarns.period());
    const std::vector<int> stitches = stitches_of(map, yarns.period(), curve, nodes);
    const int count = curve.nodes;
    const auto begin =
        static_cast<int>(std::ranges::find_if(stitches, [&](int s) { return s != stitches.back(); }) -
                         stitches.begin()) %
        count;
    for (int i = begin, end = i; i < begin + count; i = end) {
      while (end < begin + count && stitches[end % count] == stitches[i % count]) ++end;
      PliedCurve part = part_of(yarns, map, static_cast<int>(c), all, stitches[i % count], i, end - i, first);
      if (map.empty() || shown.contains(part.stitch)) curves.push_back(std::move(part));
    }
    first += static_cast<int>(segment_count(curve));
  });
  return curves;
}

/// The mean over the cells of the cloth of a sum over their curves.
template <class Value>
double cell_mean(const Yarns& yarns, const Value& value) {
  const YarnMap& map = yarns.data().map;
  std::vector<double> sums(std::size_t{1} * map.kinds.x * map.kinds.y);
  const Yarns bare = bare_yarns(yarns);
  for (const PliedCurve& curve : curves_of(bare, map)) sums[curve.stitch] += value(curve);
  double sum = 0;
  for (const std::uint16_t stitch : map.shown) sum += sums[stitch];
  return map.empty() ? sums[0] : sum / static_cast<double>(map.shown.size());
}

/// How a curve becomes a tube. With these a round one is as far from the yarn around it as along it: chords
/// of K rings, which share the bends evenly, lie bend^2 / 8 K^2 within the curve, chords of n sides r pi^2 /
/// 2 n^2 within the circle; 2 n K are the triangles. Where they suffice, the sides follow the plies.
struct Tube {
  const PliedCurve* curve = nullptr;
  int rings = min_rings;
  bool shows_plies = false;
  std::vector<SectionCorner> section;  ///< the last corner is the first, after a whole turn
  std::size_t group = 0;               ///< MergedTubes
  /// Where angles of a section without plies count from at both ends: there parts of a curve join others, so
  /// that corners are at equal angles from above.
  std::array<double, 2> ends{0, 0};
  int first_row = 0, rows = 0;  ///< of the picture
  int first_column = 0;         ///< likewise

  Tube(const PliedCurve& own, double triangles) : curve(&own) {
    const int plies = own.plies();
    for (int of_ply = full_sides_of_ply; of_ply >= min_sides_of_ply && plies > 1; --of_ply) {
      rings = std::max(
          {min_rings, rings_of(of_ply * plies), static_cast<int>(of_ply * std::abs(own.twist()) / pi)});
      shows_plies = 2.0 * of_ply * plies * rings <= triangles;
      if (!shows_plies) continue;
      for (int i = 0; i <= of_ply * plies; ++i)
        section.push_back(own.corner_of(i / of_ply, i % of_ply, of_ply));
      return;
    }
    const double best = std::min(std::sqrt(pi * triangles / own.axis.winding()), triangles / (2 * min_rings));
    const int count = std::clamp(static_cast<int>(best), min_sides, full_sides);
    rings = static_cast<int>(triangles / (2 * count));
    if (count == full_sides) rings = std::min(rings, rings_of(count));
    rings = std::max(min_rings, rings);
    // As wide in the mean as the circle.
    const double wider = pi / (count * std::sin(pi / count));
    for (int i = 0; i <= count; ++i) section.push_back({2 * pi * i / count, static_cast<float>(wider)});
    for (int k = 0; k < 2 && own.is_part(); ++k) {
      const YarnFrame frame = place_at(own.axis, k).frame;
      ends[k] = std::atan2(frame.tangent.cross(frame.across).z, frame.across.z);
    }
    ends[1] = ends[0] + std::remainder(ends[1] - ends[0], 2 * pi / count);
  }

  int sides() const { return static_cast<int>(section.size()) - 1; }
  /// Rings as near to the curve as this number of sides is to its section.
  int rings_of(int count) const { return static_cast<int>(count * curve->axis.winding() / (2 * pi)); }
  /// Where angles of the section count from.
  double first_angle(double turn, double fraction) const {
    return shows_plies ? turn : ends[0] + fraction * (ends[1] - ends[0]);
  }
  double angle_at(double side) const {
    const double whole = std::floor(side / sides()), within = side - whole * sides();
    const int i = std::min(static_cast<int>(within), sides() - 1);
    return 2 * pi * whole + section[i].angle + (section[i + 1].angle - section[i].angle) * (within - i);
  }
  /// The inverse, in [0, sides].
  double side_at(double angle) const {
    const double within = angle - 2 * pi * std::floor((angle - section[0].angle) / (2 * pi));
    const auto next =
        std::ranges::upper_bound(section.begin() + 1, section.end() - 1, within, {}, &SectionCorner::angle);
    const SectionCorner& from = *(next - 1);
    return static_cast<double>(next - section.begin() - 1) +
           std::clamp((within - from.angle) / (next->angle - from.angle), 0.0, 1.0);
  }
  std::size_t vertex(int ring, int side) const {
    return static_cast<std::size_t>(ring) * section.size() + static_cast<std::size_t>(side);
  }
};

class TubeBuilder {
 public:
  explicit TubeBuilder(const Yarns& yarns)
      : yarns_(bare_yarns(yarns)),
        map_(yarns.data().map),
        lighting_(yarns_),
        curves_(curves_of(yarns_, map_)),
        length_of_cell_(cell_mean(yarns, [](const PliedCurve& curve) { return curve.axis.length; })) {}

  RepeatMesh build(double triangles, double pixels) const {
    RepeatMesh mesh;
    std::vector<Tube> tubes;
    double length = 0, area = 0, widest = 0;

    const auto& data = yarns_.data().curves;
    for (const PliedCurve& curve : curves_) {
      Tube& tube = tubes.emplace_back(curve, triangles * curve.axis.length / length_of_cell_);
      auto group = std::ranges::find_if(mesh.tubes, [&](const MergedTubes& other) {
        return data[other.first_curve].albedo == data[curve.number].albedo &&
               data[other.first_curve].gloss == data[curve.number].gloss;
      });
      if (group == mesh.tubes.end()) group = mesh.tubes.insert(group, {curve.number, {}});
      tube.group = group - mesh.tubes.begin();
      const double girth = 2 * pi * static_cast<double>(data[curve.number].radius);
      length += curve.axis.length;
      area += girth * curve.axis.length;
      widest = std::max(widest, girth);
    }
    mesh.stitches = map_.kinds.x * map_.kinds.y;
    const std::vector<MergedTubes> groups = mesh.tubes;
    for (int stitch = 1; stitch < mesh.stitches; ++stitch)
      mesh.tubes.insert(mesh.tubes.end(), groups.begin(), groups.end());
    Image& picture = mesh.picture;
    picture.channels = 3;
    const int around = std::max(min_sides, static_cast<int>(widest / std::sqrt(area / pixels)));
    const double row = length * around / pixels;  // mm
    int bottom = 0;
    picture.width = around;
    for (Tube& tube : tubes) {
      tube.rows = std::max(min_rings, static_cast<int>(tube.curve->axis.length / row));
      if (bottom > 0 && bottom + tube.rows > max_rows) picture.width += around, bottom = 0;
      tube.first_column = picture.width - around;
      tube.first_row = bottom + margin;
      bottom = tube.first_row + tube.rows + margin;
      picture.height = std::max(picture.height, bottom);
    }

    picture.pixels.resize(std::size_t{3} * picture.width * picture.height);
    for (const Tube& tube : tubes) {
      TubeMesh& group = mesh.tubes[tube.curve->stitch * groups.size() + tube.group].mesh;
      const std::size_t first = group.positions.size();
      add_tube(tube, picture, around, group);
      paint(tube, around, std::span(group.normals).subspan(first), picture);
    }
    return mesh;
  }

 private:
  static constexpr int margin = 2;       ///< rows of a tube's picture beyond either end
  static constexpr int max_rows = 4096;  ///< side by side, of short tubes

  void add_tube(const Tube& tube, const Image& picture, int around, TubeMesh& mesh) const {
    const int sides = tube.sides(), rings = tube.rings;
    const PliedCurve& curve = *tube.curve;
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    const std::size_t count = first + tube.vertex(rings + 1, 0);
    mesh.positions.resize(count);
    mesh.normals.resize(count);
    mesh.tex_coords.resize(count);
    parallel_for(0, (rings + 1) * (sides + 1), [&](int i) {
      const int ring = i / (sides + 1), side = i % (sides + 1);
      const std::size_t vertex = first + static_cast<std::size_t>(i);
      const double fraction = double{1} * ring / rings;
      const ChainPlace place = place_at(curve.axis, fraction);
      const double from = tube.first_angle(curve.turn_at(place), fraction);
      const auto& [angle, reach] = tube.section[side];
      mesh.positions[vertex] =
          place.frame.surface_position(place.round_at(from + tube.section[side % sides].angle) * reach);
      const double column = (angle - tube.section[0].angle) / (2 * pi) * (around - 1) + 0.5;
      mesh.tex_coords[vertex] = V2f(V2d((tube.first_column + column) / picture.width,
                                        (tube.first_row + fraction * tube.rows) / picture.height));
      std::vector<YarnHit> hits;
      for (const double along : {-0.25, 0.25}) {
        const double near = (ring + along) / rings;
        const double at = curve.is_part() ? std::clamp(near, 0.0, 1.0) : near - std::floor(near);
        const ChainPlace beside = place_at(curve.axis, at);
        const double begin = tube.first_angle(curve.turn_at(beside), at);
        for (const double nearby : {-0.25, 0.25})
          hits.push_back(curve.hit_at(beside, begin + tube.angle_at(side % sides + nearby)));
      }
      mesh.normals[vertex] = lighting_.normal_at(hits);
    });
    for (int i = 0; i < rings * sides; ++i) {
      const auto at = [&](int ring, int side) {
        return first + static_cast<std::uint32_t>(tube.vertex(i / sides + ring, i % sides + side));
      };
      mesh.indices.insert(mesh.indices.end(), {at(0, 0), at(0, 1), at(1, 0), at(0, 1), at(1, 1), at(1, 0)});
    }
  }

  /// The tube's part of the picture, around the section: its last column is its first. Places that are hidden
  /// have the color that gives smaller pictures the mean of what is seen.
  void paint(const Tube& tube, int around, std::span<const V3f> normals, Image& picture) const {
    const PliedCurve& curve = *tube.curve;
    std::vector<Lighting::Shown> shown(std::size_t{1} * tube.rows * around);
    parallel_for(0, tube.rows, [&](int row) {
      const double fraction = (row + 0.5) / tube.rows, along = fraction * tube.rings;
      const ChainPlace place = place_at(curve.axis, fraction);
      const double from = tube.first_angle(curve.turn_at(place), fraction);
      const int ring = static_cast<int>(along);
      for (int x = 0; x < around; ++x) {
        const double angle = from + tube.section[0].angle + 2 * pi * x / (around - 1);
        const double at = tube.side_at(angle - from);
        const int side = std::min(static_cast<int>(at), tube.sides() - 1);
        const auto normal_on = [&](int r) {
          return mix(normals[tube.vertex(r, side)], normals[tube.vertex(r, side + 1)],
                     static_cast<float>(at - side));
        };
        const V3f normal = mix(normal_on(ring), normal_on(ring + 1), static_cast<float>(along - ring));
        std::vector<YarnHit> hits{curve.hit_at(place, angle)};
        for (const double up : {-0.25, 0.25}) {
          const ChainPlace beside = place_at(curve.axis, fraction + up / tube.rows);
          for (const double across : {-0.25, 0.25})
            hits.push_back(curve.hit_at(beside, angle + 2 * pi * across / around));
        }
        shown[std::size_t{1} * row * around + x] = lighting_.shown_at(hits, normal.normalized());
      }
    });
    V3d seen(0, 0, 0), kept(0, 0, 0);
    double weight = 0, hidden = 0;
    for (const Lighting::Shown& one : shown) {
      seen += V3d(one.color) * static_cast<double>(one.seen);
      weight += static_cast<double>(one.seen);
      kept += V3d(one.color * one.fraction);
      hidden += 1 - static_cast<double>(one.fraction);
    }
    V3f rest(0, 0, 0);
    if (hidden > 0 && weight > 0)
      rest = V3f((seen / weight * static_cast<double>(shown.size()) - kept) / hidden);
    for (int row = -margin; row < tube.rows + margin; ++row) {
      for (int x = 0; x < around; ++x) {
        const Lighting::Shown& one = shown[std::size_t{1} * std::clamp(row, 0, tube.rows - 1) * around + x];
        const V3f color = mix(rest, one.color, one.fraction);
        for (int k = 0; k < 3; ++k)
          picture.pixels[3 * ((tube.first_row + row) * picture.width + tube.first_column + x) + k] =
              std::max(0.0F, color[k]);
      }
    }
  }

  Yarns yarns_;
  YarnMap map_;

  Lighting lighting_;
  std::vector<PliedCurve> curves_;
  double length_of_cell_;  ///< mm, of all yarn, in the mean
};

}  // namespace

RepeatMesh mesh_of_repeat(const Yarns& yarns, double triangles, double pixels) {
  return TubeBuilder(yarns).build(triangles, pixels);
}

std::int64_t mesh_triangle_count(const RepeatMesh& mesh) {
  std::size_t sum = 0, cells = 0;
  for (int stitch = 0; stitch < mesh.stitches; ++stitch) {
    const std::size_t before = sum;
    for (const MergedTubes& tubes : mesh.tubes_of(stitch)) sum += tubes.mesh.indices.size() / 3;
    cells += sum > before;
  }
  return static_cast<std::int64_t>(sum / cells);
}

V2f cell_size(const Yarns& yarns) { return yarns.period() / V2f(yarns.data().map.kinds); }

double min_triangles(const Yarns& yarns) {
  return cell_mean(yarns, [](const PliedCurve&) { return 2.0 * min_sides * min_rings; });
}

double max_triangles(const Yarns& yarns) {
  return cell_mean(yarns, [](const PliedCurve& curve) {
    const Tube full(curve, 1e9);
    return 2.0 * full.sides() * full.rings;
  });
}

std::vector<YarnJoint> joints_of(const Yarns& yarns) {
  constexpr int places = 24;        // of an axis
  constexpr float touching = 1.2F;  // of the sum of the radii: places lie apart
  constexpr int reach = 2;          // repeats
  const V2f& period = yarns.period();
  const auto& curves = yarns.data().curves;
  std::vector<YarnJoint> joints;
  if (!yarns.data().map.empty()) {
    const V2f cell = cell_size(yarns);
    const V3f middle(cell.x / 2, -cell.y / 2, (yarns.geometry().min_z + yarns.geometry().max_z) / 2);
    for (const V2i& side : {V2i(1, 0), V2i(-1, 0), V2i(0, 1), V2i(0, -1)}) {
      const V3f half(middle.x * static_cast<float>(side.x), -middle.y * static_cast<float>(side.y), 0);
      joints.push_back({middle + half, middle - half, side, curves.front().radius, true});
    }
    return joints;
  }
  const Yarns bare = bare_yarns(yarns);
  const std::vector<PliedCurve> plied = curves_of(bare, {});
  const auto place_of = [&](std::size_t c, int i) {
    return place_at(plied[c].axis, static_cast<double>(i) / places).frame.position;
  };
  for (std::size_t c = 0; c < plied.size(); ++c) {
    const V2i turns = curves[c].repeat_offset;
    if (turns != V2i(0, 0)) {
      joints.push_back({place_of(c, places), place_of(c, 0), turns, curves[c].radius, true});
      joints.push_back({place_of(c, 0), place_of(c, places), -turns, curves[c].radius, true});
    }
    for (int i = 0; i < places; ++i) {
      YarnJoint nearest{place_of(c, i), {0, 0, 0}, {0, 0}, curves[c].radius};
      float least = touching;
      for (std::size_t o = 0; o < plied.size(); ++o) {
        for (int k = 0; k < places * (2 * reach + 1) * (2 * reach + 1); ++k) {
          const V2i repeat(k % (2 * reach + 1) - reach, k / (2 * reach + 1) % (2 * reach + 1) - reach);
          // Yarn that continues touches its own.
          if (repeat == V2i(0, 0) || (o == c && repeat.x * turns.y == repeat.y * turns.x)) continue;
          const V3f other = place_of(o, k / ((2 * reach + 1) * (2 * reach + 1)));
          const V3f shift(static_cast<float>(repeat.x) * period.x, static_cast<float>(repeat.y) * period.y,
                          0);
          const float distance =
              (nearest.own_point - other - shift).length() / (curves[c].radius + curves[o].radius);
          if (distance >= least) continue;
          least = distance;
          nearest.other_point = other;
          nearest.neighbour_offset = repeat;
        }
      }
      if (least < touching) joints.push_back(nearest);
    }
  }
  return joints;
}

Imath::Box2d yarn_uv_bounds(const Yarns& yarns) {
  Imath::Box2d reach;
  const V2f cell = cell_size(yarns);
  const Yarns bare = bare_yarns(yarns);
  for (const PliedCurve& curve : curves_of(bare, yarns.data().map))
    for (const Yarns::Segment& s : curve.axis.segments) {
      const V3f wide(section_extent(s.bounding_radius, s.squeeze, V3f(1, 0, 0)),
                     section_extent(s.bounding_radius, s.squeeze, V3f(0, 1, 0)), 0);
      for (const V3f& p :
           {s.start - wide, s.start + wide, s.start + s.along - wide, s.start + s.along + wide})
        reach.extendBy(V2d(p.x / cell.x, -p.y / cell.y));
    }
  return reach;
}

}  // namespace selvedge
