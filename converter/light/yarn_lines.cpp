#include "converter/light/yarn_lines.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "format/simd/wide_float.h"

namespace selvedge {
namespace {

/// How far pieces of plies reach beyond their ends, in radii: the splatter closes their joints the same way.
constexpr float end_overlap = 0.12F;

using Interval = LineScratch::Interval;

/// Lines on a grid over one period of the plane z = 0.
struct LineGrid {
  V3f direction;
  V2f slope;
  V2i count;
  V2f step;   ///< mm
  V2f shift;  ///< of the first line, in steps

  LineGrid(const V3f& d, const V2f& period, float spacing, int index)
      : direction(d), slope(d.x / d.z, d.y / d.z) {
    for (int k = 0; k < 2; ++k) {
      // About as many lines for each area across them, whatever the slope.
      const float lines = period[k] / (spacing * std::sqrt(1 + slope[k] * slope[k]));
      count[k] = std::max(1, static_cast<int>(std::lround(lines)));
      step[k] = period[k] / static_cast<float>(count[k]);
      // Roberts's sequence in two dimensions.
      constexpr std::array<double, 2> turns{0.7548776662466927, 0.5698402909980532};
      const double turned = 0.5 + index * turns[k];
      shift[k] = static_cast<float>(turned - std::floor(turned));
    }
  }
  float place(int i, int k) const { return (static_cast<float>(i) + shift[k]) * step[k]; }
  int first_from(float place, int k) const { return static_cast<int>(std::ceil(place / step[k] - shift[k])); }
  int last_to(float place, int k) const { return static_cast<int>(std::floor(place / step[k] - shift[k])); }
  int wrapped(int i, int k) const { return (i % count[k] + count[k]) % count[k]; }
};

/// A value at height 0 of the line through (x, y), linear in both.
struct LinearForm {
  float constant = 0, x = 0, y = 0;
  float at(float px, float py) const { return constant + x * px + y * py; }
};

/// Adds the intervals of all lines within a piece: a cylinder between the planes of its ends, in the space of
/// its round section.
void cross_piece(const Yarns::Segment& s, std::int32_t piece, const LineGrid& grid, LineScratch& to) {
  const V3f axis = squeezed(s.along, s.squeeze);
  const float length = axis.length();
  const V3f a = axis / length;
  const V3f way = squeezed(V3f(grid.slope.x, grid.slope.y, 1), s.squeeze);
  const float along_way = a.dot(way);
  const float way2 = way.dot(way);
  const float inverse = 1 / std::max(way2 - along_way * along_way, way2 * 1e-7F);
  const V3f across = way.cross(a);
  // The point at height 0: its distance from the axis across the way, its place along the axis; and the
  // height where the line is nearest to the axis.
  LinearForm distance, place, middle;
  const auto set = [&](const V3f& from, float LinearForm::*member) {
    const V3f f = squeezed(from, s.squeeze);
    distance.*member = f.dot(across) * inverse;
    place.*member = f.dot(a);
    middle.*member = (f.dot(a) * along_way - way.dot(f)) * inverse;
  };
  set(-s.start, &LinearForm::constant);
  set(V3f(1, 0, 0), &LinearForm::x);
  set(V3f(0, 1, 0), &LinearForm::y);
  const float r2 = s.radius * s.radius * inverse;
  const float r = std::sqrt(r2);
  const float start = s.hair_threshold > 0 ? 0 : -s.radius * end_overlap;
  const float end = length - start;
  std::array<int, 2> low{}, high{};
  for (int k = 0; k < 2; ++k) {
    const float from = s.start[k] - grid.slope[k] * s.start.z;
    const float along = s.along[k] - grid.slope[k] * s.along.z;
    const float reach = (s.half_width(s.radius) - start) * std::sqrt(1 + grid.slope[k] * grid.slope[k]);
    low[k] = grid.first_from(from + std::min(along, 0.0F) - reach, k);
    high[k] = grid.last_to(from + std::max(along, 0.0F) + reach, k);
  }
  if (low[0] > high[0] || low[1] > high[1]) return;
  const auto lines = static_cast<std::size_t>(high[0] - low[0] + 1) * (high[1] - low[1] + 1);
  if (to.found_intervals.size() < to.interval_count + lines + 1)
    to.found_intervals.resize(2 * to.interval_count + lines + 1);
  for (int j = low[1]; j <= high[1]; ++j) {
    const float y = grid.place(j, 1);
    int first = low[0];
    int last = high[0];
    const float off = distance.at(0, y);
    if (std::abs(distance.x) > 1e-9F) {
      const auto [left, right] = std::minmax({(-r - off) / distance.x, (r - off) / distance.x});
      first = std::max(first, grid.first_from(left, 0));
      last = std::min(last, grid.last_to(right, 0));
    }
    if (first > last) continue;
    const int line = grid.wrapped(j, 1) * grid.count.x;
    int column = grid.wrapped(first, 0);
    // Four lines at a time, all of which are written: whether one meets the piece cannot be predicted.
    using Four = WideFloat<4>;
    for (int i = first; i <= last; i += 4) {
      Four steps;
      for (int k = 0; k < 4; ++k) steps.v[k] = static_cast<float>(i + k);
      const Four x = (steps + Four(grid.shift[0])) * Four(grid.step[0]);
      const auto at_line = [&](const LinearForm& form) {
        return Four(form.constant) + x * Four(form.x) + Four(y * form.y);
      };
      const Four d = Four(off) + Four(distance.x) * x;
      const Four half = sqrt(max(Four(0), Four(r2) - d * d));
      const Four centre = at_line(middle);
      const Four w = at_line(place);
      Four top = centre + half;
      Four bottom = centre - half;
      if (std::abs(along_way) > 1e-6F) {
        const Four one = (Four(start) - w) / Four(along_way);
        const Four other = (Four(end) - w) / Four(along_way);
        top = min(top, max(one, other));
        bottom = max(bottom, min(one, other));
      } else {
        top = if_greater(Four(start), w, bottom, if_greater(w, Four(end), bottom, top));
      }
      for (int k = 0; k < std::min(4, last - i + 1); ++k) {
        to.found_intervals[to.interval_count] = {top.v[k], bottom.v[k], piece, line + column};
        to.interval_count += top.v[k] > bottom.v[k] ? 1 : 0;
        column = column + 1 < grid.count.x ? column + 1 : 0;
      }
    }
  }
}

/// Follows lines down through the unions of their intervals.
class LineWalk {
 public:
  LineWalk(const Yarns& yarns, const YarnPatches& patches, const LineGrid& grid, float thinnest,
           LineCrossings& out)
      : yarns_(yarns), patches_(patches), grid_(grid), near_(1e-3F * thinnest), out_(out) {}

  /// `items`: by falling tops. The line passes `at` of the plane z = 0.
  void follow(std::span<const Interval> items, const V2f& at) {
    const auto& segments = yarns_.geometry().segments;
    PatchFace above;
    PatchFace entered;
    const Interval* lowest = nullptr;  // of the ply that the line is in
    const auto meet = [&](const PatchFace& face) {
      if (above.patch >= 0)
        out_.open_air_links.push_back({above, face});
      else if (face.patch >= 0)
        out_.sky_above.push_back(face);
    };
    const auto leave = [&] {
      above = face(lowest->piece, at, lowest->bottom, -grid_.direction);
      out_.inside_links.push_back({entered.patch, above.patch});
      lowest = nullptr;
    };
    for (const Interval& item : items) {
      const Yarns::Segment& s = segments[item.piece];
      if (lowest != nullptr && item.top > lowest->bottom - near_) {
        if (s.hair_threshold == 0 && item.bottom < lowest->bottom) lowest = &item;
        continue;
      }
      if (lowest != nullptr) leave();
      if (s.hair_threshold > 0) {
        const float along = s.along.normalized().dot(grid_.direction);
        meet({patches_.hair_patch(item.piece), along});
        above = {patches_.hair_patch(item.piece), -along};
      } else {
        entered = face(item.piece, at, item.top, grid_.direction);
        meet(entered);
        lowest = &item;
      }
    }
    if (lowest != nullptr) leave();
    if (above.patch >= 0) out_.sky_below.push_back(above);
  }

 private:
  /// The surface of a piece where a line that passes `at` of the plane z = 0 is at height z.
  PatchFace face(std::int32_t piece, const V2f& at, float z, const V3f& out) const {
    const Yarns::Segment& s = yarns_.geometry().segments[piece];
    const V2f& period = yarns_.period();
    V3f off = V3f(at.x + grid_.slope.x * z, at.y + grid_.slope.y * z, z) - s.start;
    for (int k = 0; k < 2; ++k) off[k] -= std::round((off[k] - s.along[k] / 2) / period[k]) * period[k];
    const V3f along = squeezed(s.along, s.squeeze);
    const V3f round = squeezed(off, s.squeeze);
    const float fraction = std::clamp(round.dot(along) * s.inverse_length2, 0.0F, 1.0F);
    const V3f tangent = squeezed(mix(s.tangent[0], s.tangent[1], fraction), s.squeeze).normalized();
    const YarnCurve& curve = yarns_.data().curves[s.curve];
    const auto& directions = curve.plies.count > 1 ? s.axis_to_ply : s.across;
    const V3f q = round - along * fraction;
    const V3f from = mix(directions[0], directions[1], fraction);
    const float angle = std::atan2(q.dot(tangent.cross(from)), q.dot(from));
    const V3f normal = (q - tangent * tangent.dot(q)).normalized();
    const V3f fibre = stretched(tangent + tangent.cross(normal) * curve.fibre_slope, s.squeeze);
    return {patches_.front_patch(piece, s.start_station + fraction * s.station_span, angle),
            fibre.normalized().dot(out)};
  }

  const Yarns& yarns_;
  const YarnPatches& patches_;
  const LineGrid& grid_;
  float near_;  ///< mm; surfaces so close to each other touch
  LineCrossings& out_;
};

}  // namespace

YarnPatches::YarnPatches(const Yarns& yarns, int parts, int around)
    : yarns_(yarns), parts_(parts), around_(around) {
  const YarnData& data = yarns.data();
  const auto& segments = yarns.geometry().segments;
  for (const YarnCurve& curve : data.curves) {
    first_front_.push_back(fronts_);
    first_hair_.push_back(hairs_);
    fronts_ += curve.stations * parts * curve.plies.count * around_;
    hairs_ += curve.hairs.count == 0 ? 0 : curve.stations;
  }
  ply_.assign(segments.size(), 0);
  hair_.assign(segments.size(), -1);
  for (std::size_t i = 0, in_curve = 0; i < segments.size(); ++i, ++in_curve) {
    const Yarns::Segment& s = segments[i];
    if (i > 0 && segments[i - 1].curve != s.curve) in_curve = 0;
    const YarnCurve& curve = data.curves[s.curve];
    if (s.hair_threshold > 0)
      hair_[i] = first_hair_patch() + first_hair_[s.curve] +
                 std::clamp(static_cast<int>(s.start_station), 0, curve.stations - 1);
    else
      ply_[i] = static_cast<int>(in_curve) / (curve.nodes * curve.plies.divisions);
  }
}

int YarnPatches::front_patch(int piece, float station, float angle) const {
  const int curve = yarns_.geometry().segments[piece].curve;
  const YarnPlies& plies = yarns_.data().curves[curve].plies;
  const int all = yarns_.data().curves[curve].stations * parts_;
  int part = static_cast<int>(std::floor(station * static_cast<float>(parts_)));
  int ply = ply_[piece];
  if (part >= all) {
    part -= all;
    ply = ((ply + plies.shift) % plies.count + plies.count) % plies.count;
  }
  constexpr float pi = std::numbers::pi_v<float>;
  const int turned = static_cast<int>((angle + pi) * (static_cast<float>(around_) / (2 * pi)));
  return front_patch(curve, std::clamp(part, 0, all - 1), ply, std::clamp(turned, 0, around_ - 1));
}

int YarnPatches::curve_of(int patch) const {
  const auto before = [](const std::vector<int>& firsts, int index) {
    return static_cast<int>(std::ranges::upper_bound(firsts, index) - firsts.begin()) - 1;
  };
  if (patch >= first_inside_patch())
    return before(first_front_, (patch - first_inside_patch()) * fronts_per_inside);
  return patch < fronts_ ? before(first_front_, patch) : before(first_hair_, patch - first_hair_patch());
}

LineCrossings trace_lines(const Yarns& yarns, const YarnPatches& patches,
                          std::span<const std::int32_t> pieces, const V3f& direction, float spacing,
                          int index, LineScratch& scratch) {
  const LineGrid grid(direction, yarns.period(), spacing, index);
  LineCrossings& out = scratch.crossings;
  out.open_air_links.clear();
  out.inside_links.clear();
  out.sky_above.clear();
  out.sky_below.clear();
  out.area = grid.step.x * grid.step.y * direction.z;
  const auto& segments = yarns.geometry().segments;
  float thinnest = 1e30F;
  for (const YarnCurve& curve : yarns.data().curves) thinnest = std::min(thinnest, ply_or_yarn_radius(curve));
  scratch.interval_count = 0;
  for (const std::int32_t i : pieces) cross_piece(segments[i], i, grid, scratch);

  const auto lines = static_cast<std::size_t>(grid.count.x) * static_cast<std::size_t>(grid.count.y);
  std::vector<std::size_t>& first = scratch.line_begins;
  first.assign(lines + 1, 0);
  const std::span found(scratch.found_intervals.data(), scratch.interval_count);
  for (const Interval& item : found) ++first[item.line + 1];
  for (std::size_t l = 0; l < lines; ++l) first[l + 1] += first[l];
  std::vector<Interval>& sorted = scratch.sorted_intervals;
  sorted.resize(std::max(sorted.size(), found.size()));
  scratch.line_cursors.assign(first.begin(), first.end() - 1);
  for (const Interval& item : found) sorted[scratch.line_cursors[item.line]++] = item;
  LineWalk walk(yarns, patches, grid, thinnest, out);
  for (std::size_t l = 0; l < lines; ++l) {
    const std::span items(sorted.data() + first[l], first[l + 1] - first[l]);
    std::ranges::sort(items, [](const Interval& a, const Interval& b) {
      return a.top != b.top ? a.top > b.top : a.piece < b.piece;
    });
    walk.follow(items, {grid.place(static_cast<int>(l) % grid.count.x, 0),
                        grid.place(static_cast<int>(l) / grid.count.x, 1)});
  }
  return out;
}

}  // namespace selvedge
