#include "converter/stitch/yarn_tubes.h"

#include <cmath>
#include <numbers>

#include "converter/stitch/flat_yarn.h"

namespace selvedge {
namespace {

constexpr double ring_radii = 1.2;         ///< distance of rings
constexpr double coarse_ring_radii = 0.8;  ///< the least of coarse tubes, whose segments may be shorter
constexpr double ring_sag = 0.05;          ///< of the axis between them, radii

struct Ring {
  V3d centre;
  V3d tangent;
  V3d squeeze;
  double radius;
  double radius_slope;
};

std::vector<Ring> rings_of(const Yarn& yarn, double min_distance) {
  std::vector<Ring> rings;
  std::vector<double> along;
  double length = 0;
  for (std::size_t i = 0; i < yarn.segments.size(); ++i) {
    const BezierSegment& segment = yarn.segments[i];
    for (const CurveSpan& span : spans_of(segment, ring_radii * yarn.radius_mm, ring_sag * yarn.radius_mm)) {
      if (rings.empty() || length - along.back() >= min_distance) {
        rings.push_back({span.start, derivative_at(segment, span.t0).normalized(),
                         squeeze_at(yarn, i, span.t0), yarn.radius_mm, 0});
        along.push_back(length);
      }
      length += (span.end - span.start).length();
    }
  }
  along.push_back(length);
  for (std::size_t r = 0; r < rings.size(); ++r) {
    rings[r].radius = radius_with_swells(yarn, along[r], length);
    rings[r].radius_slope =
        (radius_with_swells(yarn, along[r + 1], length) - rings[r].radius) / (along[r + 1] - along[r]);
  }
  return rings;
}

void add_tube(const Yarn& yarn, int index, bool is_coarse, YarnTubes& tubes) {
  const int sides = is_coarse ? 6 : 10;
  const std::vector<Ring> rings = rings_of(yarn, is_coarse ? coarse_ring_radii * yarn.radius_mm : 0);
  auto& [positions, original, triangles] = tubes.surface;
  const auto first = static_cast<int>(positions.size());
  const V3d way = yarn.segments.back()[3] - yarn.segments.front()[0];
  const auto turned = [](const V3d& axis, const V3d& across) {
    return (across - axis * axis.dot(across)).normalized();
  };
  V3d across = std::abs(rings.front().tangent.z) < 0.9 ? V3d(0, 0, 1) : V3d(1, 0, 0);
  for (const Ring& ring : rings) {
    const V3d axis = squeezed(ring.tangent, ring.squeeze).normalized();
    across = turned(axis, across);
    const V3d beside = axis.cross(across);
    for (int k = 0; k < sides; ++k) {
      const double angle = 2 * std::numbers::pi * k / sides;
      SurfaceSample sample{.round_gradient = across * std::cos(angle) + beside * std::sin(angle),
                           .squeeze = ring.squeeze,
                           .tangent = ring.tangent,
                           .yarn = index,
                           .radius_slope = ring.radius_slope};
      sample.gradient = squeezed(sample.round_gradient, ring.squeeze).normalized();
      original.push_back(static_cast<int>(positions.size()));
      positions.push_back(
          ring.centre +
          stretched(sample.round_gradient * round_section_radius(ring.radius, ring.squeeze), ring.squeeze));
      tubes.vertex_samples.push_back(sample);
    }
  }
  // The first ring once more, from the vertex on that is nearest to the last ring's first.
  const V3d round = turned(squeezed(rings.front().tangent, rings.front().squeeze).normalized(), across);
  int turn = 0;
  for (int k = 1; k < sides; ++k)
    if (round.dot(tubes.vertex_samples[first + k].round_gradient) >
        round.dot(tubes.vertex_samples[first + turn].round_gradient))
      turn = k;
  for (int k = 0; k < sides; ++k) {
    const int copied = first + (k + turn) % sides;
    original.push_back(copied);
    positions.push_back(positions[copied] + way);
    tubes.vertex_samples.push_back(tubes.vertex_samples[copied]);
  }
  for (int r = first; r + sides < static_cast<int>(positions.size()); r += sides) {
    for (int k = 0; k < sides; ++k) {
      const int next = (k + 1) % sides;
      triangles.emplace_back(r + k, r + next, r + sides + k);
      triangles.emplace_back(r + next, r + sides + next, r + sides + k);
    }
  }
}

}  // namespace

YarnTubes tubes_of(const StitchPattern& pattern, bool is_coarse) {
  YarnTubes tubes;
  for (std::size_t y = 0; y < pattern.yarns.size(); ++y)
    add_tube(pattern.yarns[y], static_cast<int>(y), is_coarse, tubes);
  return tubes;
}

}  // namespace selvedge
