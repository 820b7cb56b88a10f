#include "converter/stitch/yarn_curves.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "converter/mesh/wall_albedo.h"

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

}  // namespace

YarnData yarn_curves_of(const StitchPattern& pattern, const YarnChainOptions& options) {
  YarnData data;
  for (const Yarn& yarn : pattern.yarns) {
    YarnCurve curve;
    curve.turns = turns_of(yarn, pattern.period_mm);
    curve.radius = static_cast<float>(yarn.radius_mm);
    // Of the light that falls on it; what comes through the wall is part of its indirect light.
    curve.albedo = V3f(wall_albedo(V3d(yarn.albedo), yarn.transmission) * (1 - yarn.transmission));
    curve.gloss = yarn.gloss;
    curve.fibre_slope = static_cast<float>(2 * std::numbers::pi * yarn.radius_mm * yarn.twist_per_mm);
    append_chain(curve, dense_points(yarn, 0.04 * yarn.radius_mm), yarn.radius_mm, options, data);
  }
  return data;
}

}  // namespace selvedge
