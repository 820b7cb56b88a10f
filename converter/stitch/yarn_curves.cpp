#include "converter/stitch/yarn_curves.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>

#include "converter/mesh/wall_albedo.h"
#include "converter/stitch/fibres.h"
#include "converter/stitch/yarn_plies.h"
#include "format/base/random.h"

namespace selvedge {
namespace {

/// Points of the yarn's curve, close enough that the chain's corners may be any of them; the last is where it
/// begins again.
std::vector<V3d> dense_points(const Yarn& yarn, double step) {
  std::vector<V3d> points;
  for (const BezierSegment& segment : yarn.segments) {
    const int count = std::max(4, static_cast<int>(std::ceil(polygon_length(segment) / step)));
    for (int k = 0; k < count; ++k) points.push_back(point_at(segment, static_cast<double>(k) / count));
  }
  points.push_back(point_at(yarn.segments.back(), 1));
  return points;
}

/// Parts of a segment of the axis that keep plies as near to their helices as chains lie to curves; 0 where
/// none do.
int divisions_for(YarnCurve curve, std::span<const V3f> nodes, const V2f& period,
                  const YarnChainOptions& options) {
  constexpr int most = 64;
  const auto radius = static_cast<double>(radius_of_plies(curve));
  for (int parts = 1; parts <= most; ++parts) {
    curve.plies.divisions = 2 * parts;
    const auto halves = segments_of(curve, nodes, period);
    bool near = true;
    for (std::size_t i = 0; i < halves.size() && near; i += 2) {
      const V3d half(halves[i].along);
      const V3d whole = half + V3d(halves[i + 1].along);
      near = whole.length() <= options.max_length * radius &&
             chord_distance(half, V3d(0), whole) <= options.max_sag * radius;
    }
    if (near) return parts;
  }
  return 0;
}

/// Gives the last curve of `data` the plies of `yarn`; false where a file cannot hold them as a formula:
/// where they turn too often, or pass their yarn's bend so close that a node of theirs lies on the next.
bool give_plies(const Yarn& yarn, const V2f& period, const YarnChainOptions& options, YarnData& data) {
  YarnCurve& curve = data.curves.back();
  const std::span nodes = std::span<const V3f>(data.nodes).last(curve.nodes);
  const PlyCourse course = course_of_plies(yarn);
  curve.plies = {yarn.plies, 1, course.shift, 0, {0, 0, 0}};
  const Yarns::Segment first = segments_of(curve, nodes, period).front();
  const V3d across(first.across[0]);
  const V3d beside = V3d(course.frames.stations.front().tangent).cross(across);
  const V3d& out = course.frames.stations.front().across;
  curve.plies.phase = static_cast<float>(std::atan2(out.dot(beside), out.dot(across)));
  curve.plies.divisions = divisions_for(curve, nodes, period, options);
  YarnData alone{{curve}, {nodes.begin(), nodes.end()}, {}, {}};
  alone.curves[0].hairs = {};
  alone.light.assign(std::size_t{light_values_per_station} * curve.stations, 0);
  return validate(alone, period).has_value();
}

constexpr std::uint64_t stream_hairs = 31;

/// As many hairs as the yarn's hairiness asks for, in the mean over seeds. Refuses more than there is `room`
/// for.
Result<YarnHairs> hairs_for(const StitchPattern& pattern, std::size_t index, int room) {
  const Yarn& yarn = pattern.yarns[index];
  YarnHairs hairs;
  if (yarn.hairiness == 0) return hairs;
  double length = 0;
  for (const BezierSegment& segment : yarn.segments) length += polygon_length(segment);
  // The mean of what is left of an exponential distribution.
  const double mean = 1 - max_hair / std::expm1(max_hair);
  const double expected = yarn.hairiness * length / (mean * yarn.hair_mm);
  if (expected >= room) {
    return fail(Code::mesh_invalid, pattern.name, fmt::format("/yarns/{}/hairiness", index),
                fmt::format("the repeat would have more than {} hairs", max_hairs));
  }
  const YarnKind fibre = fibre_of(yarn.fibre);
  hairs.count = static_cast<int>(expected + Random(mix(pattern.seed ^ mix(stream_hairs)), index).uniform());
  if (hairs.count == 0) return hairs;
  hairs.length = static_cast<float>(yarn.hair_mm);
  hairs.loops = static_cast<float>(yarn.hair_loops);
  hairs.radius = static_cast<float>(0.5e-3 * fibre.diameter_um);
  hairs.kept = static_cast<float>(1 - forward_share(fibre.refraction));
  return hairs;
}

}  // namespace

Result<YarnData> yarn_curves_of(const StitchPattern& pattern, const YarnChainOptions& options) {
  YarnData data;
  std::optional<StitchPattern> laid;
  std::size_t first_ply = 0;
  int room = max_hairs;
  for (std::size_t y = 0; y < pattern.yarns.size(); ++y) {
    const Yarn& yarn = pattern.yarns[y];
    const auto hairs = hairs_for(pattern, y, room);
    if (!hairs) return tl::unexpected(hairs.error());
    room -= hairs->count;
    YarnCurve curve;
    curve.hairs = *hairs;
    curve.flattening = static_cast<float>(yarn.flattening);
    curve.turns = turns_of(yarn, pattern.period_mm);
    curve.radius = static_cast<float>(yarn.radius_mm);
    // Of the light that falls on it; what comes through the wall is part of its indirect light.
    curve.albedo = V3f(wall_albedo(V3d(yarn.albedo), yarn.transmission) * (1 - yarn.transmission));
    curve.gloss = yarn.gloss;
    const double around = 2 * std::numbers::pi * yarn.radius_mm;
    curve.fibre_slope = static_cast<float>(
        yarn.plies > 1 ? std::tan(lean_in_plies(yarn) * std::numbers::pi / 180) : around * yarn.twist_per_mm);
    YarnChainOptions own = options;
    if (yarn.plies > 1) own.station /= 2;  // a ply is about half as thick
    if (yarn.flattening < 1) own.max_sag = options.max_flat_sag;
    append_chain(curve, dense_points(yarn, 0.04 * yarn.radius_mm), yarn.radius_mm, own, data);
    const std::size_t own_plies = first_ply;
    const int plies = yarn.plies == 1 ? 1 : std::gcd(course_of_plies(yarn).shift, yarn.plies);
    first_ply += plies;
    if (yarn.plies == 1 || give_plies(yarn, V2f(pattern.period_mm), options, data)) continue;
    // Each ply as a chain.
    data.nodes.resize(data.nodes.size() - data.curves.back().nodes);
    data.curves.pop_back();
    if (!laid) {
      auto all = lay_plies(pattern, pattern.name);
      if (!all) return tl::unexpected(all.error());
      laid = std::move(*all);
    }
    StitchPattern alone = pattern;
    const auto from = laid->yarns.begin() + static_cast<std::ptrdiff_t>(own_plies);
    alone.yarns = {from, from + plies};
    const auto chains = yarn_curves_of(alone, options);
    if (!chains) return tl::unexpected(chains.error());
    data.curves.insert(data.curves.end(), chains->curves.begin(), chains->curves.end());
    data.nodes.insert(data.nodes.end(), chains->nodes.begin(), chains->nodes.end());
  }
  return data;
}

}  // namespace selvedge
