#include "converter/stitch/yarn_curves.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "converter/mesh/wall_albedo.h"
#include "converter/stitch/yarn_plies.h"

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
  alone.light.assign(std::size_t{light_values_per_station} * curve.stations, 0);
  return validate(alone, period).has_value();
}

}  // namespace

Result<YarnData> yarn_curves_of(const StitchPattern& pattern, const YarnChainOptions& options) {
  YarnData data;
  for (const Yarn& yarn : pattern.yarns) {
    YarnCurve curve;
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
    append_chain(curve, dense_points(yarn, 0.04 * yarn.radius_mm), yarn.radius_mm, own, data);
    if (yarn.plies == 1 || give_plies(yarn, V2f(pattern.period_mm), options, data)) continue;
    // Each ply as a chain.
    data.nodes.resize(data.nodes.size() - data.curves.back().nodes);
    data.curves.pop_back();
    StitchPattern alone = pattern;
    alone.yarns = {yarn};
    const auto laid = lay_plies(alone, pattern.name);
    if (!laid) return tl::unexpected(laid.error());
    const auto plies = yarn_curves_of(*laid, options);
    if (!plies) return tl::unexpected(plies.error());
    data.curves.insert(data.curves.end(), plies->curves.begin(), plies->curves.end());
    data.nodes.insert(data.nodes.end(), plies->nodes.begin(), plies->nodes.end());
  }
  return data;
}

}  // namespace selvedge
