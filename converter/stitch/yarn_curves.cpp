#include "converter/stitch/yarn_curves.h"

#include <algorithm>
#include <cmath>
#include <numbers>

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

/// Indices of corners: from each as far as the chord stays near enough to the points between.
std::vector<std::size_t> corners_of(const std::vector<V3d>& points, double max_sag, double max_length) {
  std::vector<std::size_t> corners{0};
  while (corners.back() + 1 < points.size()) {
    const std::size_t from = corners.back();
    std::size_t to = from + 1;
    for (std::size_t next = to + 1; next < points.size(); ++next) {
      if ((points[next] - points[from]).length() > max_length) break;
      bool near = true;
      for (std::size_t i = from + 1; i < next && near; ++i) {
        near = chord_distance(points[i], points[from], points[next]) <= max_sag;
      }
      if (!near) break;
      to = next;
    }
    corners.push_back(to);
  }
  corners.pop_back();
  return corners;
}

}  // namespace

YarnData yarn_curves_of(const StitchPattern& pattern, const YarnCurveOptions& options) {
  YarnData data;
  for (const Yarn& yarn : pattern.yarns) {
    const std::vector<V3d> points = dense_points(yarn, 0.04 * yarn.radius_mm);
    std::vector<std::size_t> corners =
        corners_of(points, options.max_sag * yarn.radius_mm, options.max_length * yarn.radius_mm);
    if (corners.size() < 2) corners = {0, points.size() / 2};
    double length = 0;
    for (std::size_t i = 1; i < points.size(); ++i) length += (points[i] - points[i - 1]).length();
    YarnCurve curve;
    curve.nodes = static_cast<int>(corners.size());
    curve.stations = std::max(4, static_cast<int>(std::lround(length / (options.station * yarn.radius_mm))));
    curve.turns = turns_of(yarn, pattern.period_mm);
    curve.radius = static_cast<float>(yarn.radius_mm);
    curve.albedo = yarn.albedo;
    curve.gloss = yarn.gloss;
    curve.fibre_slope = static_cast<float>(2 * std::numbers::pi * yarn.radius_mm * yarn.twist_per_mm);
    data.curves.push_back(curve);
    const double step = std::exp2(std::floor(std::log2(yarn.radius_mm / 2048)));
    for (const std::size_t corner : corners) {
      V3d rounded = points[corner] / step;
      for (int k = 0; k < 3; ++k) rounded[k] = std::round(rounded[k]);
      data.nodes.emplace_back(rounded * step);
    }
  }
  return data;
}

}  // namespace selvedge
