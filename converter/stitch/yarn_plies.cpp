#include "converter/stitch/yarn_plies.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "converter/mesh/cell_mesh.h"
#include "converter/stitch/flat_yarn.h"
#include "converter/stitch/parameters.h"
#include "format/base/random.h"
#include "format/fabric/yarns.h"

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

using std::numbers::pi;

std::vector<Yarn> plies_of(const Yarn& yarn, const V2d& period_mm, YarnStrands swells) {
  const int n = yarn.plies;
  const double radius = yarn.radius_mm * unit_ply_radius(n);
  const double offset = yarn.radius_mm - radius;
  const PlyTwist course = ply_twist_of(yarn);
  const YarnFrames& frames = course.frames;
  const int places = course.ply_shift;
  const auto& stations = frames.stations;
  const double length = stations.back().arc_length;
  const double turn = 2 * pi * places / n - frames.total_turn;
  swells.swells = swells_of(length, radius);

  const V2i turns = chain_periods(yarn, period_mm);
  const V3d way(turns.x * period_mm.x, turns.y * period_mm.y, 0);
  const auto count = static_cast<long>(stations.size()) - 1;
  /// Point i of the ply that starts at place k; i may lie in other repeats.
  const auto point = [&](int k, long i) {
    const long repeat = i >= 0 ? i / count : -((count - 1 - i) / count);
    const YarnStation& s = stations[i - repeat * count];
    const double start = static_cast<double>(k + repeat * places) / n;
    const double angle = 2 * pi * start + turn * s.arc_length / length;
    const V3d direction = s.across * std::cos(angle) + s.tangent.cross(s.across) * std::sin(angle);
    const double orbit = offset * strand_swell(swells, s.arc_length / length, thickness_noise_byte);
    return s.position + way * static_cast<double>(repeat) +
           stretched(direction, s.squeeze) * round_section_radius(orbit, s.squeeze);
  };
  const auto slope = [&](int k, long i) {  // per station, of fourth order
    return (point(k, i + 1) - point(k, i - 1)) * (2.0 / 3) - (point(k, i + 2) - point(k, i - 2)) * (1.0 / 12);
  };
  std::vector<Yarn> plies;
  const int chains = std::gcd(places, n);
  double length_of_plies = 0;
  for (int k = 0; k < chains; ++k) {
    Yarn ply = yarn;
    ply.name = fmt::format("{}{}ply {}", yarn.name, yarn.name.empty() ? "" : ", ", k + 1);
    ply.plies = 1;
    ply.twist_per_mm = twist_of_angle(fibre_angle_in_plies(yarn), radius);
    ply.radius_mm = radius;
    if (swells.irregularity > 0) ply.swells = swells;
    ply.passes = n / chains;
    ply.segments.clear();
    for (long i = 0; i < count * (n / chains); ++i) {
      const V3d a = point(k, i);
      const V3d b = point(k, i + 1);
      if (!is_round(yarn)) ply.squeezes.push_back(stations[i % count].squeeze);
      ply.segments.push_back({a, a + slope(k, i) / 3.0, b - slope(k, i + 1) / 3.0, b});
      length_of_plies += (b - a).length();
    }
    plies.push_back(std::move(ply));
  }
  for (Yarn& ply : plies) ply.hairiness *= length / length_of_plies;
  return plies;
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
      s.arc_length = length;
      stations.push_back(s);
    }
  }
  YarnStation last = stations.front();
  last.position = point_at(yarn.segments.back(), 1);
  last.arc_length = length + (last.position - stations.back().position).length();
  stations.push_back(last);
  const V3d& tangent = stations.front().tangent;
  const V3d axis = std::abs(tangent.z) < 0.9 ? V3d(0, 0, 1) : V3d(1, 0, 0);
  stations.front().across = (axis - tangent * axis.dot(tangent)).normalized();
  for (std::size_t i = 1; i < stations.size(); ++i)
    stations[i].across = carried(stations[i - 1], stations[i]);
  const V3d first = stations.front().across;
  const V3d last_across = stations.back().across;
  const double turned = std::atan2(first.cross(last_across).dot(tangent), first.dot(last_across));
  return {std::move(stations), turned};
}

int swells_of(double length, double radius_mm) {
  return std::max(2, static_cast<int>(std::lround(length / (12 * radius_mm))));
}

int strand_seed(std::uint64_t seed, int chain) {
  return static_cast<int>(hash64(seed ^ hash64(static_cast<std::uint64_t>(chain))) & max_strand_seed);
}

PlyTwist ply_twist_of(const Yarn& yarn) {
  // At least 12 steps per turn, none longer than a ply is thick.
  const double step = std::min(yarn.radius_mm * unit_ply_radius(yarn.plies),
                               1 / (12 * std::max(std::abs(yarn.twist_per_mm), 1e-9)));
  PlyTwist course{frames_of(yarn, step)};
  const double length = course.frames.stations.back().arc_length;
  course.ply_shift = static_cast<int>(std::lround(yarn.twist_per_mm * length * yarn.plies));
  return course;
}

double fibre_angle_in_plies(const Yarn& yarn) {
  // Fibres of a ply lean to the other side than the plies of the yarn.
  return yarn.twist_per_mm > 0 ? 0 - yarn.fibre_degrees : yarn.fibre_degrees;
}

Result<StitchPattern> lay_plies(const StitchPattern& pattern, const std::string& file) {
  StitchPattern laid = pattern;
  laid.yarns.clear();
  for (const Yarn& yarn : pattern.yarns) {
    YarnStrands swells{.seed = strand_seed(pattern.seed, static_cast<int>(laid.yarns.size())),
                       .irregularity = std::min(static_cast<float>(yarn.irregularity), max_irregularity)};
    if (yarn.plies == 1) {
      laid.yarns.push_back(yarn);
      if (yarn.irregularity == 0) continue;
      swells.swells =
          swells_of(frames_of(yarn, 0.5 * yarn.radius_mm).stations.back().arc_length, yarn.radius_mm);
      laid.yarns.back().swells = swells;
      continue;
    }
    for (Yarn& ply : plies_of(yarn, pattern.period_mm, swells)) laid.yarns.push_back(std::move(ply));
  }
  // Plies of a rising yarn may reach slightly higher than the yarn.
  StitchLimits limits;
  limits.segments *= 8;
  limits.reach_periods *= 8;
  if (auto sound = validate(laid, file, limits); !sound) return tl::unexpected(sound.error());
  return laid;
}

}  // namespace selvedge
