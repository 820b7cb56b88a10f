#include "converter/stitch/clearance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "converter/mesh/surface_points.h"
#include "converter/mesh/yarn_chain.h"
#include "converter/stitch/flat_yarn.h"

namespace selvedge {
namespace {

/// Length and sag of pieces, in radii, that allow one nearest point each and tight bounds.
constexpr double piece_length_radii = 0.5;
constexpr double piece_sag_radii = 0.02;

/// About 0.6 GB: a loop of usual yarn has some 90.
constexpr double max_pieces = 2e6;

/// Distances of points from pieces of yarn that are computed to find a clearance: some seconds.
constexpr double max_distances = 5e8;

struct Piece {
  BezierSegment segment;
  CurveSpan span;
  double radius = 0;  ///< half the width, the larger one of both ends
  int yarn = 0;
  double start_length = 0;  ///< along the yarn's chain, by chords, mm
  double start_radius = 0;
  double end_radius = 0;
  V3d start_squeeze{0, 0, 0};
  V3d end_squeeze{0, 0, 0};
  /// The nearest point is sought in the section of a ply's middle; across a yarn it is the nearest of all.
  V3d search_squeeze{0, 0, 0};
  /// Fraction of the way from start to end.
  double part(double t) const { return (t - span.t0) / (span.t1 - span.t0); }
  double length() const { return (span.end - span.start).length(); }
  double radius_at(double t) const { return start_radius + part(t) * (end_radius - start_radius); }
  bool is_flat() const { return start_squeeze != V3d(0, 0, 0) || end_squeeze != V3d(0, 0, 0); }
  /// As flat as between both ends, also where the yarn turns.
  V3d squeeze_at(double t) const;
  double nearest_to(const V3d& point) const;
};

struct Pieces {
  std::vector<Piece> pieces;
  std::vector<double> yarn_length;
  std::vector<V2i> turns;  ///< of yarns: periods that their chains take
};

V3d Piece::squeeze_at(double t) const {
  if (!is_flat()) return {0, 0, 0};
  const V3d between = squeeze_between(start_squeeze, end_squeeze, part(t));
  const double length = start_squeeze.length() + (end_squeeze.length() - start_squeeze.length()) * part(t);
  return between.length2() > 0 ? between * (length / between.length()) : between;
}

double Piece::nearest_to(const V3d& point) const {
  if (search_squeeze == V3d(0, 0, 0)) return nearest_parameter(segment, span.t0, span.t1, point);
  BezierSegment round = segment;
  for (V3d& p : round) p = squeezed(p, search_squeeze);
  return nearest_parameter(round, span.t0, span.t1, squeezed(point, search_squeeze));
}

Result<Pieces> pieces_of(const StitchPattern& pattern, const std::string& file) {
  double estimate = 0;
  for (const Yarn& yarn : pattern.yarns)
    for (const BezierSegment& segment : yarn.segments)
      estimate += 1 + polygon_length(segment) / (piece_length_radii * yarn.radius_mm);
  if (estimate > max_pieces)
    return fail(Code::mesh_invalid, file, "/yarns",
                fmt::format("the yarns are too long for their radius: about {:.0f} pieces, at most {:.0f}",
                            estimate, max_pieces));
  Pieces cut;
  cut.pieces.reserve(static_cast<std::size_t>(estimate));
  for (std::size_t y = 0; y < pattern.yarns.size(); ++y) {
    const Yarn& yarn = pattern.yarns[y];
    double length = 0;
    const std::size_t first = cut.pieces.size();
    for (std::size_t i = 0; i < yarn.segments.size(); ++i) {
      const BezierSegment& segment = yarn.segments[i];
      for (const CurveSpan& span :
           spans_of(segment, piece_length_radii * yarn.radius_mm, piece_sag_radii * yarn.radius_mm)) {
        cut.pieces.push_back({segment, span, yarn.radius_mm, static_cast<int>(y), length});
        Piece& piece = cut.pieces.back();
        length += piece.length();
        if (is_round(yarn)) continue;
        piece.start_squeeze = squeeze_at(yarn, i, span.t0);
        piece.end_squeeze = squeeze_at(yarn, i, span.t1);
        if (!yarn.squeezes.empty()) piece.search_squeeze = piece.squeeze_at(0.5 * (span.t0 + span.t1));
      }
    }
    cut.yarn_length.push_back(length);
    cut.turns.push_back(chain_periods(yarn, pattern.period_mm));
    for (Piece& piece : std::span(cut.pieces).subspan(first)) {
      piece.start_radius = radius_with_swells(yarn, piece.start_length, length);
      piece.end_radius = radius_with_swells(yarn, piece.start_length + piece.length(), length);
      piece.radius = std::max(piece.start_radius, piece.end_radius) /
                     std::sqrt(1 - std::max(piece.start_squeeze.length2(), piece.end_squeeze.length2()));
    }
  }
  return cut;
}

/// Whether a place of a piece is less than pi radii along the yarn from one of another, moved by periods.
bool are_adjacent(const Pieces& cut, const Piece& a, double ta, const Piece& b, double tb, const V2i& shift) {
  if (a.yarn != b.yarn) return false;
  const V2i& turn = cut.turns[a.yarn];
  const double chain = cut.yarn_length[a.yarn];
  double along = b.start_length + b.part(tb) * b.length() - a.start_length - a.part(ta) * a.length();
  if (turn == V2i(0, 0)) {
    if (shift != V2i(0, 0)) return false;
    along = std::abs(along);
    along = std::min(along, chain - along);
  } else {
    const int count = turn.x != 0 ? shift.x / turn.x : shift.y / turn.y;
    if (turn * count != shift) return false;
    along = std::abs(along + count * chain);
  }
  return along < std::numbers::pi * a.radius;
}

}  // namespace

Result<double> minimum_clearance(const StitchPattern& pattern, const std::string& file) {
  double smallest = 0;
  for (const Yarn& yarn : pattern.yarns) smallest = std::max(smallest, half_width_of(yarn));
  const auto cut = pieces_of(pattern, file);
  if (!cut) return tl::unexpected(cut.error());
  const V2d& period = pattern.period_mm;
  const auto wrap = [&](const V3d& point) {
    return V3d(wrap_to_repeat(point.x, period.x), wrap_to_repeat(point.y, period.y), point.z);
  };
  const auto periods = [&](const V3d& way) {
    return V2i(static_cast<int>(std::lround(way.x / period.x)),
               static_cast<int>(std::lround(way.y / period.y)));
  };
  // Pieces lie within this of their middles.
  const auto reach_of = [](const Piece& piece) {
    return 0.5 * piece.length() + piece.span.sag + piece.radius;
  };
  std::vector<V3d> middles;
  middles.reserve(cut->pieces.size());
  double farthest = 0;
  for (const Piece& piece : cut->pieces) {
    middles.push_back(wrap((piece.span.start + piece.span.end) * 0.5));
    farthest = std::max(farthest, reach_of(piece));
  }
  const PeriodicGrid grid(middles, period, 2 * farthest);

  constexpr int steps = 8;  // points per piece: 1/16 of a radius apart
  double distances = 0;
  const auto look_at = [&](const Piece& a, const Piece& b, const V2i& shift) {
    const double radii = a.radius + b.radius;
    const auto away = [&](const V3d& local) {
      return chord_distance(local, b.span.start, b.span.end) - b.span.sag - radii;
    };
    const V3d moved(shift.x * period.x, shift.y * period.y, 0);
    if (away((a.span.start + a.span.end) * 0.5 - moved) - 0.5 * a.length() - a.span.sag >= smallest) return;
    distances += steps;
    for (int step = 0; step < steps; ++step) {
      const double ta = a.span.t0 + (a.span.t1 - a.span.t0) * (step + 0.5) / steps;
      const V3d point = point_at(a.segment, ta);
      const V3d wrapped = wrap(point);
      const V2i own = shift - periods(point - wrapped);
      const V3d local = wrapped - V3d(own.x * period.x, own.y * period.y, 0);
      if (away(local) >= smallest) continue;
      if (are_adjacent(*cut, a, ta, b, b.span.t0, shift) && are_adjacent(*cut, a, ta, b, b.span.t1, shift))
        continue;
      const double tb = b.nearest_to(local);
      if (are_adjacent(*cut, a, ta, b, tb, shift)) continue;
      const V3d apart = local - point_at(b.segment, tb);
      if (apart.length2() == 0 || !(a.is_flat() || b.is_flat())) {
        smallest = std::min(smallest, apart.length() - radii);
        continue;
      }
      const YarnSection of_a{a.radius_at(ta), a.squeeze_at(ta)};
      const YarnSection of_b{b.radius_at(tb), b.squeeze_at(tb)};
      const auto room = [&](const V3d& d) {
        return apart.dot(d) - support_of(of_a, d) - support_of(of_b, d);
      };
      // There is no less in the best direction.
      if (room(apart.normalized()) >= smallest) continue;
      smallest = std::min(smallest, room(separating_direction(apart, of_a, of_b)));
    }
  };
  for (std::size_t k = 0; k < middles.size(); ++k) {
    const Piece& a = cut->pieces[k];
    double reach = reach_of(a) + farthest + smallest;
    grid.visit_near(middles[k], reach, [&](int other, const V3d& offset) {
      const Piece& b = cut->pieces[other];
      const double near = reach_of(a) + reach_of(b) + smallest;
      ++distances;
      if (near <= 0 || offset.length2() >= near * near) return;
      const V3d between = (a.span.start + a.span.end - b.span.start - b.span.end) * 0.5;
      look_at(a, b, periods(between + offset));
    });
    if (distances > max_distances)
      return fail(Code::mesh_invalid, file, "/yarns", "the yarns are too many and too close to each other");
  }
  return smallest;
}

}  // namespace selvedge
