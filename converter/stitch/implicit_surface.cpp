#include "converter/stitch/implicit_surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "converter/mesh/surface_points.h"
#include "converter/mesh/yarn_chain.h"
#include "converter/stitch/flat_yarn.h"

namespace selvedge {
namespace {

/// Length and sag of spans, in radii, that allow one nearest point each and tight bounds.
constexpr double span_length_radii = 0.5;
constexpr double span_sag_radii = 0.02;

/// Limits of the index, about 200 MB, beside 0.3 kB for each piece: a loop of usual yarn has some 90.
constexpr double max_curve_pieces = 2e6;
constexpr std::size_t max_entries = 1 << 24;
constexpr int max_bins_per_axis = 96;

int bin_count(double extent, double size) {
  return static_cast<int>(std::clamp(std::floor(extent / size), 1.0, static_cast<double>(max_bins_per_axis)));
}

/// First and last bin that a range of coordinates touches.
std::pair<int, int> bins_touched(double low, double high, double size, int count) {
  const auto clamped = [&](double c) {
    return static_cast<int>(std::clamp(std::floor(c / size), 0.0, static_cast<double>(count - 1)));
  };
  return {clamped(low), clamped(high)};
}

}  // namespace

Result<ImplicitSurface> ImplicitSurface::build(const StitchPattern& pattern, double reach,
                                               const std::string& file) {
  auto surface = cut(pattern, file);
  if (!surface) return surface;
  double min_radius = pattern.yarns.front().radius_mm;
  for (const Yarn& yarn : pattern.yarns) min_radius = std::min(min_radius, yarn.radius_mm);
  surface->reach_ = reach;
  // Bins much smaller than the reach would repeat the same pieces.
  const double size = std::max(0.5 * min_radius, 0.25 * reach);
  double times = 1;
  while (!surface->index(size * times) && times < 8) times *= 1.25;
  if (surface->entries_.empty())
    return fail(Code::mesh_invalid, file, "/yarns", "the yarns are too many and too close for the index");
  return surface;
}

Result<ImplicitSurface> ImplicitSurface::cut(const StitchPattern& pattern, const std::string& file) {
  double estimate = 0;
  for (const Yarn& yarn : pattern.yarns)
    for (const BezierSegment& segment : yarn.segments)
      estimate += 1 + polygon_length(segment) / (span_length_radii * yarn.radius_mm);
  if (estimate > max_curve_pieces)
    return fail(Code::mesh_invalid, file, "/yarns",
                fmt::format("the yarns are too long for their radius: about {:.0f} pieces, at most {:.0f}",
                            estimate, max_curve_pieces));
  ImplicitSurface surface;
  surface.period_ = pattern.period_mm;
  surface.pieces_.reserve(static_cast<std::size_t>(estimate));
  surface.low_ = std::numeric_limits<double>::max();
  surface.high_ = std::numeric_limits<double>::lowest();
  for (std::size_t y = 0; y < pattern.yarns.size(); ++y) {
    const Yarn& yarn = pattern.yarns[y];
    double length = 0;
    const std::size_t first = surface.pieces_.size();
    for (std::size_t i = 0; i < yarn.segments.size(); ++i) {
      const BezierSegment& segment = yarn.segments[i];
      for (const CurveSpan& span :
           spans_of(segment, span_length_radii * yarn.radius_mm, span_sag_radii * yarn.radius_mm)) {
        surface.pieces_.push_back({segment, span, yarn.radius_mm, static_cast<int>(y), length});
        Piece& piece = surface.pieces_.back();
        length += piece.length();
        if (is_round(yarn)) continue;
        piece.start_squeeze = selvedge::squeeze_at(yarn, i, span.t0);
        piece.end_squeeze = selvedge::squeeze_at(yarn, i, span.t1);
        piece.min_fraction = 1 - std::max(piece.start_squeeze.length2(), piece.end_squeeze.length2());
        if (!yarn.squeezes.empty()) piece.search_squeeze = piece.squeeze_at(0.5 * (span.t0 + span.t1));
      }
    }
    surface.yarn_length_.push_back(length);
    surface.turns_.push_back(chain_periods(yarn, pattern.period_mm));
    for (std::size_t p = first; p < surface.pieces_.size(); ++p) {
      Piece& piece = surface.pieces_[p];
      piece.start_radius = radius_with_swells(yarn, piece.start_length, length);
      piece.end_radius = radius_with_swells(yarn, piece.start_length + piece.length(), length);
      const double larger = std::max(piece.start_radius, piece.end_radius);
      piece.radius = larger / std::sqrt(piece.min_fraction);
      const auto tall = [&](const V3d& squeeze) {
        return section_extent(round_section_radius(larger, squeeze), squeeze, V3d(0, 0, 1));
      };
      const double thickest = std::max(tall(piece.start_squeeze), tall(piece.end_squeeze));
      const double margin = thickest + piece.span.sag;
      surface.low_ = std::min(surface.low_, std::min(piece.span.start.z, piece.span.end.z) - margin);
      surface.high_ = std::max(surface.high_, std::max(piece.span.start.z, piece.span.end.z) + margin);
    }
  }
  return surface;
}

template <class Visit>
bool ImplicitSurface::for_each_entry(std::size_t p, const Visit& visit) const {
  const CurveSpan& span = pieces_[p].span;
  const double half_diagonal = 0.5 * bin_size_.length() * (1 + 1e-9);
  const double margin = pieces_[p].radius + reach_ + span.sag;
  V3d low;
  V3d high;
  for (int i = 0; i < 3; ++i) {
    low[i] = std::min(span.start[i], span.end[i]) - margin;
    high[i] = std::max(span.start[i], span.end[i]) + margin;
  }
  const auto [z0, z1] = bins_touched(low.z - low_, high.z - low_, bin_size_.z, bins_.z);
  const int last_x = -static_cast<int>(std::floor(low.x / period_.x));
  const int last_y = -static_cast<int>(std::floor(low.y / period_.y));
  for (int sy = -static_cast<int>(std::floor(high.y / period_.y)); sy <= last_y; ++sy) {
    for (int sx = -static_cast<int>(std::floor(high.x / period_.x)); sx <= last_x; ++sx) {
      const V3d shift(sx * period_.x, sy * period_.y, 0);
      const auto [x0, x1] = bins_touched(low.x + shift.x, high.x + shift.x, bin_size_.x, bins_.x);
      const auto [y0, y1] = bins_touched(low.y + shift.y, high.y + shift.y, bin_size_.y, bins_.y);
      const Entry entry{static_cast<std::int32_t>(p), static_cast<std::int16_t>(sx),
                        static_cast<std::int16_t>(sy)};
      for (int z = z0; z <= z1; ++z) {
        // Bins at the bottom and the top extend to infinity.
        const bool outermost = z == 0 || z == bins_.z - 1;
        for (int y = y0; y <= y1; ++y) {
          for (int x = x0; x <= x1; ++x) {
            const V3d centre((x + 0.5) * bin_size_.x, (y + 0.5) * bin_size_.y,
                             (z + 0.5) * bin_size_.z + low_);
            const double distance = chord_distance(centre, span.start + shift, span.end + shift);
            if (!outermost && distance > margin + half_diagonal) continue;
            if (!visit((z * bins_.y + y) * bins_.x + x, entry)) return false;
          }
        }
      }
    }
  }
  return true;
}

bool ImplicitSurface::index(double size) {
  const double thickness = high_ - low_;
  bins_ = {bin_count(period_.x, size), bin_count(period_.y, size), bin_count(thickness, size)};
  bin_size_ = {period_.x / bins_.x, period_.y / bins_.y, thickness / bins_.z};
  const auto bin_total = static_cast<std::size_t>(bins_.x) * static_cast<std::size_t>(bins_.y) *
                         static_cast<std::size_t>(bins_.z);
  bin_start_.assign(bin_total + 1, 0);
  std::size_t total = 0;
  for (std::size_t p = 0; p < pieces_.size(); ++p) {
    const bool fits = for_each_entry(p, [&](std::size_t bin, const Entry&) {
      ++bin_start_[bin + 1];
      return ++total <= max_entries;
    });
    if (!fits) return false;
  }
  for (std::size_t b = 0; b < bin_total; ++b) bin_start_[b + 1] += bin_start_[b];
  entries_.resize(total);
  std::vector<std::uint32_t> next(bin_start_.begin(), bin_start_.end() - 1);
  for (std::size_t p = 0; p < pieces_.size(); ++p) {
    for_each_entry(p, [&](std::size_t bin, const Entry& entry) {
      entries_[next[bin]++] = entry;
      return true;
    });
  }
  return true;
}

V3d ImplicitSurface::Piece::squeeze_at(double t) const {
  if (!flat()) return {0, 0, 0};
  const V3d between = squeeze_between(start_squeeze, end_squeeze, part(t));
  const double length = start_squeeze.length() + (end_squeeze.length() - start_squeeze.length()) * part(t);
  return between.length2() > 0 ? between * (length / between.length()) : between;
}

double ImplicitSurface::Piece::nearest_to(const V3d& point) const {
  if (search_squeeze == V3d(0, 0, 0)) return nearest_parameter(segment, span.t0, span.t1, point);
  BezierSegment round = segment;
  for (V3d& p : round) p = squeezed(p, search_squeeze);
  return nearest_parameter(round, span.t0, span.t1, squeezed(point, search_squeeze));
}

V3d ImplicitSurface::wrap(const V3d& point) const {
  return {wrap_to_repeat(point.x, period_.x), wrap_to_repeat(point.y, period_.y), point.z};
}

std::size_t ImplicitSurface::bin_of(const V3d& wrapped) const {
  const int x = bins_touched(wrapped.x, wrapped.x, bin_size_.x, bins_.x).first;
  const int y = bins_touched(wrapped.y, wrapped.y, bin_size_.y, bins_.y).first;
  const int z = bins_touched(wrapped.z - low_, wrapped.z - low_, bin_size_.z, bins_.z).first;
  return (z * bins_.y + y) * bins_.x + x;
}

SurfaceSample ImplicitSurface::sample(const V3d& point) const {
  const V3d wrapped = wrap(point);
  const std::size_t bin = bin_of(wrapped);
  SurfaceSample best{.distance = reach_};
  const Piece* nearest = nullptr;
  double parameter = 0;
  for (std::uint32_t e = bin_start_[bin]; e < bin_start_[bin + 1]; ++e) {
    const Entry& entry = entries_[e];
    const Piece& piece = pieces_[entry.piece];
    const V3d local = wrapped - V3d(entry.shift_x * period_.x, entry.shift_y * period_.y, 0);
    const double bound = chord_distance(local, piece.span.start, piece.span.end) - piece.span.sag;
    const double beyond = bound - piece.radius;
    if (std::min(beyond, beyond * piece.min_fraction) >= best.distance) continue;
    const double t = piece.nearest_to(local);
    const V3d squeeze = piece.squeeze_at(t);
    const V3d offset = squeezed(local - point_at(piece.segment, t), squeeze);
    const double length = offset.length();
    const double radius = round_section_radius(piece.radius_at(t), squeeze);
    if (length - radius < best.distance) {
      best.distance = length - radius;
      best.round_gradient = length > 0 ? offset / length : V3d(0, 0, 0);
      best.squeeze = squeeze;
      best.yarn = piece.yarn;
      nearest = &piece;
      parameter = t;
    }
  }
  if (nearest == nullptr) return best;
  best.gradient =
      nearest->flat() ? squeezed(best.round_gradient, best.squeeze).normalized() : best.round_gradient;
  best.tangent = derivative_at(nearest->segment, parameter).normalized();
  const double length = nearest->length();
  if (length > 0) best.radius_slope = (nearest->end_radius - nearest->start_radius) / length;
  return best;
}

bool ImplicitSurface::are_adjacent(const Piece& a, double ta, const Piece& b, double tb,
                                   const V2i& shift) const {
  if (a.yarn != b.yarn) return false;
  const V2i& turn = turns_[a.yarn];
  const double chain = yarn_length_[a.yarn];
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

Result<double> minimum_clearance(const StitchPattern& pattern, const std::string& file) {
  double smallest = 0;
  for (const Yarn& yarn : pattern.yarns) smallest = std::max(smallest, half_width_of(yarn));
  auto cut = ImplicitSurface::cut(pattern, file);
  if (!cut) return tl::unexpected(cut.error());
  const ImplicitSurface& surface = *cut;
  using Piece = ImplicitSurface::Piece;
  const auto periods = [&](const V3d& way) {
    return V2i(static_cast<int>(std::lround(way.x / surface.period_.x)),
               static_cast<int>(std::lround(way.y / surface.period_.y)));
  };
  // Pieces lie within this of their middles.
  const auto reach_of = [](const Piece& piece) {
    return 0.5 * piece.length() + piece.span.sag + piece.radius;
  };
  std::vector<V3d> middles;
  middles.reserve(surface.pieces_.size());
  double farthest = 0;
  for (const Piece& piece : surface.pieces_) {
    middles.push_back(surface.wrap((piece.span.start + piece.span.end) * 0.5));
    farthest = std::max(farthest, reach_of(piece));
  }
  const PeriodicGrid grid(middles, surface.period_, 2 * farthest);

  constexpr int steps = 8;  // points per piece: 1/16 of a radius apart
  double distances = 0;
  const auto look_at = [&](const Piece& a, const Piece& b, const V2i& shift) {
    const double radii = a.radius + b.radius;
    const auto away = [&](const V3d& local) {
      return chord_distance(local, b.span.start, b.span.end) - b.span.sag - radii;
    };
    const V3d moved(shift.x * surface.period_.x, shift.y * surface.period_.y, 0);
    if (away((a.span.start + a.span.end) * 0.5 - moved) - 0.5 * a.length() - a.span.sag >= smallest) return;
    distances += steps;
    for (int step = 0; step < steps; ++step) {
      const double ta = a.span.t0 + (a.span.t1 - a.span.t0) * (step + 0.5) / steps;
      const V3d point = point_at(a.segment, ta);
      const V3d wrapped = surface.wrap(point);
      const V2i own = shift - periods(point - wrapped);
      const V3d local = wrapped - V3d(own.x * surface.period_.x, own.y * surface.period_.y, 0);
      if (away(local) >= smallest) continue;
      if (surface.are_adjacent(a, ta, b, b.span.t0, shift) &&
          surface.are_adjacent(a, ta, b, b.span.t1, shift))
        continue;
      const double tb = b.nearest_to(local);
      if (surface.are_adjacent(a, ta, b, tb, shift)) continue;
      const V3d apart = local - point_at(b.segment, tb);
      if (apart.length2() == 0 || !(a.flat() || b.flat())) {
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
    const Piece& a = surface.pieces_[k];
    double reach = reach_of(a) + farthest + smallest;
    grid.visit_near(middles[k], reach, [&](int other, const V3d& offset) {
      const Piece& b = surface.pieces_[other];
      const double near = reach_of(a) + reach_of(b) + smallest;
      ++distances;
      if (near <= 0 || offset.length2() >= near * near) return;
      const V3d between = (a.span.start + a.span.end - b.span.start - b.span.end) * 0.5;
      look_at(a, b, periods(between + offset));
    });
    if (distances > max_clearance_distances)
      return fail(Code::mesh_invalid, file, "/yarns", "the yarns are too many and too close to each other");
  }
  return smallest;
}

}  // namespace selvedge
