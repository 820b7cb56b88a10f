#include "converter/stitch/bezier.h"

#include <algorithm>
#include <cmath>

#include "converter/mesh/yarn_chain.h"

namespace selvedge {
namespace {

constexpr int max_depth = 16;

void split(const BezierSegment& segment, double t0, double t1, int depth, double max_length, double max_sag,
           std::vector<CurveSpan>& spans) {
  // The curve lies in the convex hull of its control points, and distance to a chord is convex: the inner
  // control points bound it.
  const double sag = std::max(chord_distance(segment[1], segment[0], segment[3]),
                              chord_distance(segment[2], segment[0], segment[3]));
  if (depth >= max_depth || (sag <= max_sag && polygon_length(segment) <= max_length)) {
    spans.push_back({t0, t1, segment[0], segment[3], sag});
    return;
  }
  const V3d ab = (segment[0] + segment[1]) * 0.5;
  const V3d bc = (segment[1] + segment[2]) * 0.5;
  const V3d cd = (segment[2] + segment[3]) * 0.5;
  const V3d abc = (ab + bc) * 0.5;
  const V3d bcd = (bc + cd) * 0.5;
  const V3d middle = (abc + bcd) * 0.5;
  const double t = (t0 + t1) * 0.5;
  split({segment[0], ab, abc, middle}, t0, t, depth + 1, max_length, max_sag, spans);
  split({middle, bcd, cd, segment[3]}, t, t1, depth + 1, max_length, max_sag, spans);
}

V3d second_derivative_at(const BezierSegment& segment, double t) {
  const V3d a = segment[2] - segment[1] * 2.0 + segment[0];
  const V3d b = segment[3] - segment[2] * 2.0 + segment[1];
  return (a * (1 - t) + b * t) * 6.0;
}

}  // namespace

V3d point_at(const BezierSegment& segment, double t) {
  const double s = 1 - t;
  return segment[0] * (s * s * s) + segment[1] * (3 * s * s * t) + segment[2] * (3 * s * t * t) +
         segment[3] * (t * t * t);
}

V3d derivative_at(const BezierSegment& segment, double t) {
  const double s = 1 - t;
  return ((segment[1] - segment[0]) * (s * s) + (segment[2] - segment[1]) * (2 * s * t) +
          (segment[3] - segment[2]) * (t * t)) *
         3.0;
}

double polygon_length(const BezierSegment& segment) {
  return (segment[1] - segment[0]).length() + (segment[2] - segment[1]).length() +
         (segment[3] - segment[2]).length();
}

double polygon_length(std::span<const BezierSegment> chain) {
  double length = 0;
  for (const BezierSegment& segment : chain) length += polygon_length(segment);
  return length;
}

std::vector<CurveSpan> spans_of(const BezierSegment& segment, double max_length, double max_sag) {
  std::vector<CurveSpan> spans;
  split(segment, 0, 1, 0, max_length, max_sag, spans);
  return spans;
}

double nearest_parameter(const BezierSegment& segment, double t0, double t1, const V3d& point) {
  // Half the derivative of the squared distance; its sign change is the nearest point.
  const auto slope = [&](double t) { return (point_at(segment, t) - point).dot(derivative_at(segment, t)); };
  if (slope(t0) >= 0) return t0;
  if (slope(t1) <= 0) return t1;
  double low = t0;
  double high = t1;
  double t = (t0 + t1) * 0.5;
  for (int i = 0; i < 60; ++i) {
    const V3d offset = point_at(segment, t) - point;
    const V3d velocity = derivative_at(segment, t);
    const double value = offset.dot(velocity);
    (value < 0 ? low : high) = t;
    const double curvature = velocity.length2() + offset.dot(second_derivative_at(segment, t));
    double next = curvature > 0 ? t - value / curvature : low - 1;
    if (!(next > low && next < high)) next = (low + high) * 0.5;  // Newton left the bracket: bisect
    if (std::abs(next - t) <= 1e-15) return next;
    t = next;
  }
  return t;
}

}  // namespace selvedge
