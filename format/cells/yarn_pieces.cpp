#include "format/cells/yarn_pieces.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

namespace selvedge {
namespace {

/// Largest turn along a piece of a ply, 14 degrees: beyond that the splatter's joints leave gaps in bends.
constexpr float min_turn_cosine = 0.970F;
constexpr std::size_t padding = 16;

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

std::array<Group, 2> strands_of(const YarnCurve& curve, const V2f& sense, const Yarns::Segment& s) {
  const YarnStrands& strands = curve.strands;
  const bool some = strands.count != 0 && !(s.hair_threshold > 0);
  const auto count = some ? static_cast<float>(std::abs(strands.count)) : 1.0F;
  const float width = 2 * std::numbers::pi_v<float> * s.half_width(s.radius) / count;
  return {{{count, some ? static_cast<float>(shift_within_turn(strands)) : 0,
            static_cast<float>(strands.shift) / count, static_cast<float>(s.rows.first_row)},
           {static_cast<float>(s.rows.next_first_row), width, some ? sense.x : 0, some ? sense.y : 0}}};
}

/// Pieces as long as so many segments of mean length `step`, of each curve as many of its own as fit, but
/// shorter in bends.
YarnPieces pieces_of(const Yarns& yarns, int segments, float step) {
  const Yarns::Geometry inside = yarns.geometry();
  const YarnData& data = yarns.data();
  YarnPieces pieces;
  std::vector<Yarns::Segment> hairs;
  std::span<const Yarns::Segment> rest = inside.segments;
  hairs.reserve(std::ranges::count_if(rest, [](const Yarns::Segment& s) { return s.hair_threshold > 0; }));
  pieces.segments.reserve(inside.segments.size());
  for (const YarnCurve& curve : data.curves) {
    const int of_ply = curve.nodes * curve.plies.divisions;
    float length = 0;
    for (const Yarns::Segment& s : rest.first(of_ply)) length += s.along.length();
    const float fit = static_cast<float>(segments) * step * static_cast<float>(of_ply) / length;
    const int chain = std::clamp(static_cast<int>(fit * 1.01F), 1, segments);
    for (int ply = 0; ply < curve.plies.count; ++ply) {
      for (int i = 0, count = 0; i < of_ply; i += count) {
        count = std::min(chain, of_ply - i);
        while (count > 1 && rest[i].tangent[0].dot(rest[i + count - 1].tangent[1]) < min_turn_cosine) --count;
        pieces.segments.push_back(chord(rest.subspan(i, count)));
      }
      rest = rest.subspan(of_ply);
    }
    for (; !rest.empty() && rest.front().hair_threshold > 0; rest = rest.subspan(1))
      hairs.push_back(rest.front());
  }
  // Hairs that vanish together are in one vector of the splatter.
  std::ranges::stable_sort(hairs, std::ranges::greater{}, min_empty_width);
  pieces.ply_piece_count = pieces.count();
  pieces.segments.insert(pieces.segments.end(), hairs.begin(), hairs.end());
  for (const Yarns::Segment& s : hairs)
    pieces.thickest_hair_radius = std::max(pieces.thickest_hair_radius, s.radius);
  for (std::vector<float>& values : pieces.numbers) values.reserve(pieces.segments.size() + padding);
  pieces.strands.reserve(pieces.segments.size());
  for (const Yarns::Segment& s : pieces.segments) {
    const V3f axis = squeezed(s.along, s.squeeze);
    const float length = axis.length();
    const std::array<float, YarnPieces::field_count> numbers{
        s.start.x,       s.start.y,       s.start.z,        s.along.x,        s.along.y, s.along.z,
        axis.x / length, axis.y / length, axis.z / length,  length,           s.radius,  s.squeeze.x,
        s.squeeze.y,     s.squeeze.z,     s.hair_threshold, s.bounding_radius};
    for (std::size_t k = 0; k < numbers.size(); ++k) pieces.numbers[k].push_back(numbers[k]);
    pieces.strands.push_back(strands_of(data.curves[s.curve], inside.strand_sense[s.curve], s));
  }
  for (std::vector<float>& values : pieces.numbers) values.resize(pieces.segments.size() + padding);
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
  for (const Yarns::Segment& s : yarns.geometry().segments) {
    if (s.hair_threshold > 0) continue;
    step_ += s.along.length();
    ++plies;
  }
  step_ /= static_cast<float>(plies);
}

const YarnPieces& CellYarn::pieces(float longest) const {
  std::size_t best = 0;
  while (best + 1 < detail_lengths.size() && static_cast<float>(detail_lengths[best + 1]) * step_ <= longest)
    ++best;
  Detail& detail = (*details_)[best];
  std::call_once(detail.once, [&] { detail.pieces = pieces_of(*yarns_, detail_lengths[best], step_); });
  return detail.pieces;
}

}  // namespace selvedge
