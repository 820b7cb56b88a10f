#include "converter/mesh/yarn_chain.h"

#include <algorithm>
#include <cmath>

namespace selvedge {
namespace {

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

double chord_distance(const V3d& point, const V3d& a, const V3d& b) {
  const V3d chord = b - a;
  const double length2 = chord.length2();
  const double t = length2 > 0 ? std::clamp((point - a).dot(chord) / length2, 0.0, 1.0) : 0.0;
  return (point - (a + chord * t)).length();
}

void append_chain(YarnCurve curve, const std::vector<V3d>& points, double radius,
                  const YarnChainOptions& options, YarnData& data) {
  std::vector<std::size_t> corners =
      corners_of(points, options.max_sag * radius, options.max_length * radius);
  if (corners.size() < 2) corners = {0, points.size() / 2};
  double length = 0;
  for (std::size_t i = 1; i < points.size(); ++i) length += (points[i] - points[i - 1]).length();
  curve.nodes = static_cast<int>(corners.size());
  curve.stations = std::max(4, static_cast<int>(std::lround(length / (options.station * radius))));
  data.curves.push_back(curve);
  const double step = std::exp2(std::floor(std::log2(radius / 2048)));
  for (const std::size_t corner : corners) {
    V3d rounded = points[corner] / step;
    for (int k = 0; k < 3; ++k) rounded[k] = std::round(rounded[k]);
    data.nodes.emplace_back(rounded * step);
  }
}

}  // namespace selvedge
