#include "converter/stitch/yarn_frames.h"

#include <cmath>

#include "converter/stitch/flat_yarn.h"

namespace selvedge {
namespace {

/// `across` of one station carried to the next by two reflections (Wang et al. 2008), which minimises its
/// rotation about the curve.
V3d carried(const YarnStation& from, const YarnStation& to) {
  const V3d way = to.position - from.position;
  const double way2 = way.length2();
  if (way2 == 0) return from.across;
  const V3d across = from.across - way * (2 * way.dot(from.across) / way2);
  const V3d tangent = from.tangent - way * (2 * way.dot(from.tangent) / way2);
  const V3d turn = to.tangent - tangent;
  const double turn2 = turn.length2();
  return turn2 == 0 ? across : across - turn * (2 * turn.dot(across) / turn2);
}

V3d any_across(const V3d& tangent) {
  const V3d axis = std::abs(tangent.z) < 0.9 ? V3d(0, 0, 1) : V3d(1, 0, 0);
  return (axis - tangent * axis.dot(tangent)).normalized();
}

}  // namespace

YarnFrames frames_of(const Yarn& yarn, double step) {
  std::vector<YarnStation> stations;
  double length = 0;
  for (std::size_t i = 0; i < yarn.segments.size(); ++i) {
    const BezierSegment& segment = yarn.segments[i];
    const auto count = static_cast<int>(std::ceil(polygon_length(segment) / step));
    for (int k = 0; k < count; ++k) {
      const double t = static_cast<double>(k) / count;
      YarnStation s{point_at(segment, t), derivative_at(segment, t).normalized(), V3d(0), 0,
                    squeeze_at(yarn, i, t)};
      if (!stations.empty()) length += (s.position - stations.back().position).length();
      s.length = length;
      stations.push_back(s);
    }
  }
  YarnStation last = stations.front();
  last.position = point_at(yarn.segments.back(), 1);
  last.length = length + (last.position - stations.back().position).length();
  stations.push_back(last);
  stations.front().across = any_across(stations.front().tangent);
  for (std::size_t i = 1; i < stations.size(); ++i) {
    stations[i].across = carried(stations[i - 1], stations[i]);
  }
  const V3d first = stations.front().across;
  const V3d last_across = stations.back().across;
  const V3d tangent = stations.front().tangent;
  const double turned = std::atan2(first.cross(last_across).dot(tangent), first.dot(last_across));
  return {std::move(stations), turned};
}

}  // namespace selvedge
