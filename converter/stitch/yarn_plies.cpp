#include "converter/stitch/yarn_plies.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace selvedge {
namespace {

using std::numbers::pi;

/// A place along a yarn with two unit vectors across it.
struct Station {
  V3d position;
  V3d tangent;
  V3d across;
  double length = 0;  ///< from the start
};

/// `across` of one station carried to the next by two reflections (Wang et al. 2008), which minimises its
/// rotation about the curve.
V3d carried(const Station& from, const Station& to) {
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

/// Stations at most `step` apart; the last one is where the next repeat begins.
std::vector<Station> stations_of(const Yarn& yarn, double step) {
  std::vector<Station> stations;
  double length = 0;
  for (const BezierSegment& segment : yarn.segments) {
    const auto count = static_cast<int>(std::ceil(polygon_length(segment) / step));
    for (int k = 0; k < count; ++k) {
      const double t = static_cast<double>(k) / count;
      Station s{point_at(segment, t), derivative_at(segment, t).normalized(), V3d(0), 0};
      if (!stations.empty()) length += (s.position - stations.back().position).length();
      s.length = length;
      stations.push_back(s);
    }
  }
  Station last = stations.front();
  last.position = point_at(yarn.segments.back(), 1);
  last.length = length + (last.position - stations.back().position).length();
  stations.push_back(last);
  stations.front().across = any_across(stations.front().tangent);
  for (std::size_t i = 1; i < stations.size(); ++i) {
    stations[i].across = carried(stations[i - 1], stations[i]);
  }
  return stations;
}

std::vector<Yarn> plies_of(const Yarn& yarn, const V2d& period_mm) {
  const int n = yarn.plies;
  const double radius = yarn.radius_mm * ply_radius(n);
  const double offset = yarn.radius_mm - radius;
  // At least 12 steps per turn, none longer than a ply is thick.
  const double step = std::min(radius, 1 / (12 * std::max(std::abs(yarn.twist_per_mm), 1e-9)));
  const std::vector<Station> stations = stations_of(yarn, step);
  const double length = stations.back().length;
  const V3d first = stations.front().across;
  const V3d carried_on = stations.back().across;
  const V3d tangent = stations.front().tangent;
  // Rotation of the frame about the curve after one repeat.
  const double turned = std::atan2(first.cross(carried_on).dot(tangent), first.dot(carried_on));
  const auto places = static_cast<int>(std::lround(yarn.twist_per_mm * length * n));
  const double turn = 2 * pi * places / n - turned;

  const V2i turns = turns_of(yarn, period_mm);
  const V3d way(turns.x * period_mm.x, turns.y * period_mm.y, 0);
  const auto count = static_cast<long>(stations.size()) - 1;
  /// Point i of the ply that starts at place k; i may lie in other repeats.
  const auto point = [&](int k, long i) {
    const long repeat = i >= 0 ? i / count : -((count - 1 - i) / count);
    const Station& s = stations[i - repeat * count];
    const double start = static_cast<double>(k + repeat * places) / n;
    const double angle = 2 * pi * start + turn * s.length / length;
    const V3d direction = s.across * std::cos(angle) + s.tangent.cross(s.across) * std::sin(angle);
    return s.position + way * static_cast<double>(repeat) + direction * offset;
  };
  const auto slope = [&](int k, long i) {  // per station, of fourth order
    return (point(k, i + 1) - point(k, i - 1)) * (2.0 / 3) - (point(k, i + 2) - point(k, i - 2)) * (1.0 / 12);
  };
  std::vector<Yarn> plies;
  const int chains = std::gcd(places, n);
  for (int k = 0; k < chains; ++k) {
    Yarn ply = yarn;
    ply.name = fmt::format("{}{}ply {}", yarn.name, yarn.name.empty() ? "" : ", ", k + 1);
    ply.plies = 1;
    ply.twist_per_mm = 0;
    ply.radius_mm = radius;
    ply.segments.clear();
    for (long i = 0; i < count * (n / chains); ++i) {
      const V3d a = point(k, i);
      const V3d b = point(k, i + 1);
      ply.segments.push_back({a, a + slope(k, i) / 3.0, b - slope(k, i + 1) / 3.0, b});
    }
    plies.push_back(std::move(ply));
  }
  return plies;
}

}  // namespace

double ply_radius(int plies) {
  const double sine = std::sin(pi / plies);
  return plies == 1 ? 1 : sine / (1 + sine);
}

Result<StitchPattern> lay_plies(const StitchPattern& pattern, const std::string& file) {
  StitchPattern laid = pattern;
  laid.yarns.clear();
  for (const Yarn& yarn : pattern.yarns) {
    if (yarn.plies == 1) {
      laid.yarns.push_back(yarn);
      continue;
    }
    for (Yarn& ply : plies_of(yarn, pattern.period_mm)) laid.yarns.push_back(std::move(ply));
  }
  // Plies of a rising yarn may reach slightly higher than the yarn.
  StitchLimits limits;
  limits.segments *= 8;
  limits.reach_periods *= 8;
  if (auto sound = validate(laid, file, limits); !sound) return tl::unexpected(sound.error());
  return laid;
}

}  // namespace selvedge
