// Cubic Bézier curves: evaluation, subdivision into short spans, and the nearest point of a span.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "format/base/vec.h"

namespace selvedge {

/// Four control points of a cubic Bézier curve.
using BezierSegment = std::array<V3d, 4>;

V3d point_at(const BezierSegment& segment, double t);
V3d derivative_at(const BezierSegment& segment, double t);

/// Sum of the control polygon's sides: an upper bound of the curve's length.
double polygon_length(const BezierSegment& segment);
/// The sum of these.
double polygon_length(std::span<const BezierSegment> chain);

/// The part t0 <= t <= t1 of a segment, and its chord. All points of it lie within `sag` of the chord.
struct CurveSpan {
  double t0 = 0;
  double t1 = 1;
  V3d start;
  V3d end;
  double sag = 0;
};

/// Halves the segment until every span's control polygon is at most max_length long and its sag at most
/// max_sag, but no deeper than 2^16 spans. In order of t.
std::vector<CurveSpan> spans_of(const BezierSegment& segment, double max_length, double max_sag);

/// The parameter in [t0, t1] whose point is nearest to `point`, to the last bits of a double. Exact if the
/// span bends little (as spans of spans_of() do) and `point` is nearer than its centre of curvature.
double nearest_parameter(const BezierSegment& segment, double t0, double t1, const V3d& point);

}  // namespace selvedge
