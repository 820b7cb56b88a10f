#include "converter/stitch/bezier.h"

#include <doctest/doctest.h>

#include <cmath>

#include "converter/mesh/yarn_chain.h"

using namespace selvedge;

namespace {

const BezierSegment bent{V3d(0, 0, 0), V3d(1, 2, 0.5), V3d(2, -1, 1), V3d(3, 1, -0.5)};

}  // namespace

TEST_CASE("a Bézier curve is the Bernstein sum of its control points") {
  for (const double t : {0.0, 0.2, 0.5, 0.9, 1.0}) {
    V3d sum(0);
    const double weights[] = {std::pow(1 - t, 3), 3 * t * (1 - t) * (1 - t), 3 * t * t * (1 - t), t * t * t};
    for (std::size_t i = 0; i < 4; ++i) sum += bent[i] * weights[i];
    CHECK((point_at(bent, t) - sum).length() < 1e-15 * 10);  // a handful of roundings
  }
}

TEST_CASE("spans join, and no point is further from its chord than the sag") {
  const auto spans = spans_of(bent, 0.3, 0.01);
  CHECK(spans.size() > 8);
  CHECK(spans.front().t0 == 0.0);
  CHECK(spans.back().t1 == 1.0);
  for (std::size_t i = 0; i < spans.size(); ++i) {
    if (i > 0) CHECK(spans[i].t0 == spans[i - 1].t1);
    CHECK((spans[i].end - spans[i].start).length() <= 0.3);
    CHECK(spans[i].sag <= 0.01);
    for (int k = 0; k <= 10; ++k) {
      const V3d p = point_at(bent, spans[i].t0 + (spans[i].t1 - spans[i].t0) * k / 10);
      CHECK(chord_distance(p, spans[i].start, spans[i].end) <= spans[i].sag + 1e-14);
    }
  }
}

TEST_CASE("the nearest point is where the way to it is perpendicular, or an end") {
  for (const CurveSpan& span : spans_of(bent, 0.3, 0.01)) {
    const V3d at = point_at(bent, 0.5 * (span.t0 + span.t1));
    const V3d along = derivative_at(bent, 0.5 * (span.t0 + span.t1)).normalized();
    const V3d off = along.cross(V3d(0.3, 0.5, 0.8)).normalized();
    const double t = nearest_parameter(bent, span.t0, span.t1, at + off * 0.05);
    // The foot of a perpendicular of 0.05 is unique: no curvature radius here is that small.
    CHECK(std::abs(t - 0.5 * (span.t0 + span.t1)) < 1e-12);
    CHECK(nearest_parameter(bent, span.t0, span.t1, span.start - along * 0.5) == span.t0);
    CHECK(nearest_parameter(bent, span.t0, span.t1, span.end + along * 0.5) == span.t1);
  }
}
