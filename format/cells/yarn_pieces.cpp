#include "format/cells/yarn_pieces.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <utility>

namespace selvedge {
namespace {

/// Least cosine between the ends of a piece of a ply: 14 degrees, and of large cells, of which a pixel shows
/// many pieces, 30.
constexpr float min_turn_cosine = 0.970F;
constexpr float min_turn_cosine_of_large = 0.866F;
/// Fraction of its radius by which a piece is longer at either end, at least.
constexpr float min_joint = 0.12F;
constexpr std::size_t padding = 16;
constexpr std::size_t run_length = 16;  ///< of pieces, and of runs
constexpr std::size_t segments_of_large_cell = 65536;
/// Where a pixel would show more pieces of hairs of a large cell, one hair stands for several, as much
/// thicker. The pixel is the smallest one that shows a level of detail, whose pieces are so many pixels long
/// at most.
constexpr float max_hair_pieces_per_pixel = 4;
constexpr float longest_piece_pixels = 1.5F;
constexpr float hairs_of_place = 128;  ///< hairs of large cells are in the order of places

/// One segment in place of `chain`.
Yarns::Segment chord(std::span<const Yarns::Segment> chain) {
  Yarns::Segment s = chain.front();
  const Yarns::Segment& last = chain.back();
  s.along = last.start + last.along - s.start;
  s.tangent[1] = last.tangent[1];
  s.across[1] = last.across[1];
  s.axis_to_ply[1] = last.axis_to_ply[1];
  s.station_span = 0;
  s.radius = 0;
  for (const Yarns::Segment& part : chain) {
    s.station_span += part.station_span;
    s.radius += part.radius / static_cast<float>(chain.size());
  }
  s.squeeze = chain[chain.size() / 2].squeeze;
  s.inverse_length2 = 1 / squeezed(s.along, s.squeeze).length2();
  return s;
}

/// Lengthens a ply's piece to where the outer sides of two that meet at its turn do.
float joint_of(const Yarns::Segment& s) {
  if (s.hair_threshold > 0) return 0;
  const float cosine = std::clamp(s.tangent[0].dot(s.tangent[1]), 0.0F, 1.0F);
  return s.radius * std::max(min_joint, std::sqrt((1 - cosine) / (1 + cosine)));
}

std::array<Group, 2> strands_of(const YarnCurve& curve, const V2f& sense, const Yarns::Segment& s) {
  const YarnStrands& strands = curve.strands;
  const bool some = strands.count != 0 && !(s.hair_threshold > 0);
  const auto count = some ? static_cast<float>(std::abs(strands.count)) : 1.0F;
  const float width = 2 * std::numbers::pi_v<float> * s.half_width(s.radius) / count;
  return {{{count, some ? static_cast<float>(shift_within_turn(strands)) : 0,
            static_cast<float>(strands.shift) / count, static_cast<float>(s.rows.first_row)},
           {static_cast<float>(s.rows.next_first_row), width, some ? sense.x : 0, some ? sense.y : 0}}};
}

/// A piece, and the number of its stitch; without a map 0.
using NumberedPiece = std::pair<int, Yarns::Segment>;

/// A segment, or those from it on, as a piece that lies in the first repeat with its stitch.
NumberedPiece in_first_repeat(const Yarns& yarns, std::size_t segment, Yarns::Segment s) {
  const V2i& kinds = yarns.data().map.kinds;
  if (yarns.data().map.empty()) return {0, s};
  const V2i& stitch = yarns.geometry().stitches[segment];
  const V2i kind = YarnMap::within(stitch, kinds);
  const V2f moved = V2f((kind - stitch) / kinds) * yarns.period();
  s.start += V3f(moved.x, moved.y, 0);
  return {kind.y * kinds.x + kind.x, s};
}

/// A piece of a hair, in the order of pieces.
struct HairPiece {
  int place = 0;            ///< of large cells; of a map, its stitch
  float wide = 0;           ///< min_empty_width(), below 0
  std::size_t segment = 0;  ///< of Yarns::Geometry
  auto operator<=>(const HairPiece&) const = default;
};

/// Hairs that vanish together are in one vector of the splatter; in large cells hairs of one place, and with
/// a map of one stitch.
void sort_hairs(const Yarns& yarns, bool is_small, std::vector<HairPiece>& hairs) {
  const V2f& period = yarns.period();
  V2i places(1, 1);
  if (!is_small) {
    const float per_area = static_cast<float>(hairs.size()) / (hairs_of_place * period.x * period.y);
    for (int axis = 0; axis < 2; ++axis)
      places[axis] = static_cast<int>(std::ceil(period[axis] * std::sqrt(per_area)));
  }
  const Yarns::Geometry inside = yarns.geometry();
  for (HairPiece& hair : hairs) {
    const Yarns::Segment& s = inside.segments[hair.segment];
    V2i at;
    for (int axis = 0; axis < 2; ++axis) {
      const float middle = (s.start[axis] + s.along[axis] / 2) / period[axis];
      at[axis] = static_cast<int>((middle - std::floor(middle)) * static_cast<float>(places[axis]));
    }
    hair.place =
        inside.stitches.empty() ? at.y * places.x + at.x : in_first_repeat(yarns, hair.segment, s).first;
    hair.wide = -min_empty_width(s);
  }
  std::ranges::sort(hairs);
}

/// The box of a piece: of a hair around its axis, in the first repeat.
YarnPieces::Run box_of(const Yarns::Segment& s, bool is_hair, float radius, const V2f& period) {
  // As the splatter's boxes.
  const V3f wide(is_hair ? 0 : s.half_width(radius));
  V3f start = s.start;
  // Hairs of one place may root in different repeats.
  for (int axis = 0; axis < 2 && is_hair; ++axis) {
    const float middle = s.start[axis] + s.along[axis] / 2;
    start[axis] -= std::floor(middle / period[axis]) * period[axis];
  }
  Imath::Box3f box;
  for (const V3f& end : {start, start + s.along}) {
    box.extendBy(end - wide);
    box.extendBy(end + wide);
  }
  return {{}, box, is_hair ? radius / s.hair_threshold : HUGE_VALF};
}

/// Adds a piece or a run to the last run or group, if it follows and there is room, else to a new one.
void add_to(std::vector<YarnPieces::Run>& runs, const YarnPieces::Run& part, bool follows) {
  const int next = runs.empty() ? 0 : runs.back().range.end;
  if (!follows || next == 0 || next - runs.back().range.begin == run_length)
    runs.push_back({{next, next}, {}, part.max_width});
  YarnPieces::Run& run = runs.back();
  ++run.range.end;
  run.box.extendBy(part.box);
  run.max_width = std::max(run.max_width, part.max_width);
}

/// Finds runs of neighbours, groups of these, and the groups of stitches; `numbers`: of the pieces' stitches.
void add_runs(const Yarns& yarns, std::span<const int> numbers, YarnPieces& pieces) {
  V3f end(0, 0, 0);  // of the piece before
  for (int i = 0; i < pieces.count(); ++i) {
    const Yarns::Segment& s = pieces.segment(i);
    const bool is_hair = i >= pieces.ply_piece_count;
    const bool follows = i > 0 && numbers[i] == numbers[i - 1] &&
                         (is_hair ? i > pieces.ply_piece_count : (s.start - end).length() < s.radius);
    add_to(pieces.runs, box_of(s, is_hair, pieces.numbers[YarnPieces::radius][i], yarns.period()), follows);
    end = s.start + s.along;
  }
  for (const YarnPieces::Run& run : pieces.runs) {
    const int first = run.range.begin;
    add_to(pieces.groups, run,
           first > 0 && first != pieces.ply_piece_count && numbers[first] == numbers[first - 1]);
  }
  const V2i& kinds = yarns.data().map.kinds;
  const V2f cell = yarns.period() / V2f(kinds);
  pieces.stitches.resize(std::size_t{1} * kinds.x * kinds.y);
  for (int i = 0; const YarnPieces::Run& group : pieces.groups) {
    const int first = pieces.runs[group.range.begin].range.begin;
    YarnPieces::Stitch& stitch = pieces.stitches[numbers[first]];
    PieceRange& all = first >= pieces.ply_piece_count ? stitch.hairs : stitch.plies;
    if (all.end == 0) all.begin = i;
    all.end = ++i;
    const V2i at(numbers[first] % kinds.x, numbers[first] / kinds.x);
    for (int axis = 0; axis < 2; ++axis)
      pieces.reach_beyond_stitch[axis] = std::max(
          {pieces.reach_beyond_stitch[axis], static_cast<float>(at[axis]) * cell[axis] - group.box.min[axis],
           group.box.max[axis] - static_cast<float>(at[axis] + 1) * cell[axis]});
    pieces.box.extendBy(group.box);
  }
}

/// Gives pieces their numbers and strands; hairs are so much thicker.
void add_numbers(const Yarns& yarns, float thicker, YarnPieces& pieces) {
  for (std::vector<float>& values : pieces.numbers) values.reserve(pieces.count() + padding);
  pieces.strands.reserve(pieces.count());
  for (int i = 0; i < pieces.count(); ++i) {
    const Yarns::Segment& s = pieces.segment(i);
    const float wider = i < pieces.ply_piece_count ? 1 : thicker;
    const float radius = wider * s.radius;
    const float bound = wider * s.bounding_radius;
    const V3f axis = squeezed(s.along, s.squeeze);
    const float length = axis.length();
    const std::array<float, YarnPieces::field_count> numbers{
        s.start.x,       s.start.y,       s.start.z,       s.along.x,        s.along.y,   s.along.z,
        axis.x / length, axis.y / length, axis.z / length, length,           joint_of(s), radius,
        s.squeeze.x,     s.squeeze.y,     s.squeeze.z,     s.hair_threshold, bound};
    for (std::size_t k = 0; k < numbers.size(); ++k) pieces.numbers[k].push_back(numbers[k]);
    pieces.strands.push_back(
        strands_of(yarns.data().curves[s.curve], yarns.geometry().strand_sense[s.curve], s));
  }
  for (std::vector<float>& values : pieces.numbers) values.resize(pieces.count() + padding);
}

/// Pieces as long as so many segments of mean length `step`, of each curve as many of its own as fit, but
/// shorter in bends.
YarnPieces pieces_of(const Yarns& yarns, int segments, float step) {
  const Yarns::Geometry inside = yarns.geometry();
  const YarnData& data = yarns.data();
  const YarnMap& map = data.map;
  YarnPieces pieces;
  std::vector<NumberedPiece> plies;
  std::vector<HairPiece> hairs;
  std::span<const Yarns::Segment> rest = inside.segments;
  const auto hair_count = static_cast<float>(
      std::ranges::count_if(rest, [](const Yarns::Segment& s) { return s.hair_threshold > 0; }));
  const float pixel = static_cast<float>(segments) * step / longest_piece_pixels;
  const bool is_small = map.empty() && inside.segments.size() < segments_of_large_cell;
  const float hairs_for_one =
      is_small ? 1
               : std::max(1.0F, hair_count * pixel * pixel /
                                    (max_hair_pieces_per_pixel * yarns.period().x * yarns.period().y));
  float hair_number = 0;
  hairs.reserve(static_cast<std::size_t>(hair_count / hairs_for_one));
  for (const YarnCurve& curve : data.curves) {
    const int of_ply = curve.nodes * curve.plies.divisions;
    float length = 0;
    for (const Yarns::Segment& s : rest.first(of_ply)) length += s.along.length();
    const float fit = static_cast<float>(segments) * step * static_cast<float>(of_ply) / length;
    const int chain = std::clamp(static_cast<int>(fit * 1.01F), 1, segments);
    const int along = curve.repeat_offset.x == 0 ? 1 : 0;
    const float stitch_length =
        map.empty() ? HUGE_VALF : yarns.period()[along] / static_cast<float>(map.kinds[along]);
    const float turn_cosine = is_small ? min_turn_cosine : min_turn_cosine_of_large;
    // The stitch that a map shows is found from a point of a piece (PointShader).
    const auto is_one = [&](std::size_t i, std::size_t k) {
      const Yarns::Segment& a = inside.segments[i];
      const Yarns::Segment& b = inside.segments[k];
      return a.tangent[0].dot(b.tangent[1]) >= turn_cosine &&
             (map.empty() ||
              (inside.stitches[i] == inside.stitches[k] &&
               std::abs(b.start[along] + b.along[along] - a.start[along]) < stitch_length / 2));
    };
    for (int ply = 0; ply < curve.plies.count; ++ply) {
      const auto first = static_cast<std::size_t>(rest.data() - inside.segments.data());
      for (int i = 0, count = 0; i < of_ply; i += count) {
        count = std::min(chain, of_ply - i);
        while (count > 1 && !is_one(first + i, first + i + count - 1)) --count;
        plies.push_back(in_first_repeat(yarns, first + i, chord(rest.subspan(i, count))));
      }
      rest = rest.subspan(of_ply);
    }
    for (; !rest.empty() && rest.front().hair_threshold > 0; rest = rest.subspan(1)) {
      const float hair = std::floor(hair_number++ / (hair_point_count - 1));
      if (std::floor((hair + 1) / hairs_for_one) == std::floor(hair / hairs_for_one)) continue;
      hairs.push_back({.segment = static_cast<std::size_t>(&rest.front() - inside.segments.data())});
    }
  }
  if (!map.empty()) std::ranges::stable_sort(plies, {}, &NumberedPiece::first);
  sort_hairs(yarns, is_small, hairs);
  std::vector<int> stitches;
  pieces.all = inside.segments;
  pieces.plies.reserve(plies.size());
  for (const auto& [stitch, s] : plies) {
    stitches.push_back(stitch);
    pieces.plies.push_back(s);
  }
  pieces.ply_piece_count = pieces.count();
  pieces.min_hair_bound = HUGE_VALF;
  for (const HairPiece& hair : hairs) {
    stitches.push_back(map.empty() ? 0 : hair.place);
    pieces.hairs.push_back(static_cast<std::uint32_t>(hair.segment));
    const Yarns::Segment& s = inside.segments[hair.segment];
    pieces.thickest_hair_radius = std::max(pieces.thickest_hair_radius, hairs_for_one * s.radius);
    pieces.widest_hair_radius = std::max(pieces.widest_hair_radius, hairs_for_one * s.bounding_radius);
    pieces.min_hair_bound = std::min(pieces.min_hair_bound, hairs_for_one * s.bounding_radius);
  }
  add_numbers(yarns, hairs_for_one, pieces);
  add_runs(yarns, stitches, pieces);
  return pieces;
}

}  // namespace

CellYarn::CellYarn(const Yarns& yarns, float plane, std::span<const float> sky)
    : yarns_(&yarns),
      plane_(plane),
      sky_(sky),
      details_(std::make_shared<std::array<Detail, detail_lengths.size()>>()) {
  for (const YarnCurve& curve : yarns.data().curves) flat_ |= !curve.is_round();
  int plies = 0;
  large_ = !yarns.data().map.empty() || yarns.geometry().segments.size() >= segments_of_large_cell;
  for (const Yarns::Segment& s : yarns.geometry().segments) {
    if (s.hair_threshold > 0) continue;
    step_ += s.along.length();
    ++plies;
  }
  step_ /= static_cast<float>(plies);
}

const YarnPieces& CellYarn::pieces(float longest) const {
  std::size_t best = 0;
  const std::size_t count = large_ ? detail_lengths.size() : small_cell_detail_count;
  while (best + 1 < count && static_cast<float>(detail_lengths[best + 1]) * step_ <= longest) ++best;
  Detail& detail = (*details_)[best];
  std::call_once(detail.once, [&] { detail.pieces = pieces_of(*yarns_, detail_lengths[best], step_); });
  return detail.pieces;
}

}  // namespace selvedge
