#include "converter/mesh/yarn_chain.h"

#include <algorithm>
#include <cmath>

namespace selvedge {
namespace {

/// Sections change by no more from a corner to the next.
constexpr double max_squeeze = 0.15;

/// Length of the difference of two squeezes, of which g and -g are the same section.
double squeeze_change(const ChainPoint& a, const ChainPoint& b) {
  return (a.squeeze - (a.squeeze.dot(b.squeeze) < 0 ? -b.squeeze : b.squeeze)).length();
}

/// Indices of corners: from each as far as the chord stays near enough to the points between.
std::vector<std::size_t> corners_of(const std::vector<ChainPoint>& points, double max_sag,
                                    double max_length) {
  std::vector<std::size_t> corners{0};
  while (corners.back() + 1 < points.size()) {
    const std::size_t from = corners.back();
    std::size_t to = from + 1;
    for (std::size_t next = to + 1; next < points.size(); ++next) {
      if ((points[next].position - points[from].position).length() > max_length) break;
      bool near = true;
      for (std::size_t i = from + 1; i < next && near; ++i)
        near = chord_distance(points[i].position, points[from].position, points[next].position) <= max_sag &&
               squeeze_change(points[from], points[i]) <= max_squeeze;
      if (!near) break;
      to = next;
    }
    corners.push_back(to);
  }
  corners.pop_back();
  return corners;
}

}  // namespace

double chord_distance(const V3d& point, const V3d& a, const V3d& b) {
  const V3d chord = b - a;
  const double length2 = chord.length2();
  const double t = length2 > 0 ? std::clamp((point - a).dot(chord) / length2, 0.0, 1.0) : 0.0;
  return (point - (a + chord * t)).length();
}

void append_chain(YarnCurve curve, const std::vector<ChainPoint>& points, double radius,
                  const YarnChainOptions& options, YarnData& data) {
  std::vector<std::size_t> corners =
      corners_of(points, options.max_sag * radius, options.max_length_radii * radius);
  if (corners.size() < 2) corners = {0, points.size() / 2};
  double length = 0;
  for (std::size_t i = 1; i < points.size(); ++i)
    length += (points[i].position - points[i - 1].position).length();
  curve.nodes = static_cast<int>(corners.size());
  curve.stations =
      std::max(4, static_cast<int>(std::lround(length / (options.station_spacing_radii * radius))));
  const bool is_squashed = !curve.squeezes.empty();
  curve.squeezes.clear();
  const double step = std::exp2(std::floor(std::log2(radius / 2048)));
  const auto rounded = [](const V3d& v, double to) {
    return V3f(V3d(std::round(v.x / to), std::round(v.y / to), std::round(v.z / to)) * to);
  };
  constexpr double squeeze_step = 1.0 / 256;
  for (const std::size_t corner : corners) {
    data.nodes.push_back(rounded(points[corner].position, step));
    if (is_squashed) curve.squeezes.push_back(rounded(points[corner].squeeze, squeeze_step));
  }
  data.curves.push_back(std::move(curve));
}

}  // namespace selvedge
