#include "converter/stitch/yarn_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "converter/mesh/surface_points.h"
#include "converter/mesh/wall_albedo.h"
#include "converter/stitch/fibres.h"
#include "converter/stitch/flat_yarn.h"
#include "converter/stitch/yarn_plies.h"
#include "format/base/guard.h"
#include "format/base/memory.h"
#include "format/base/random.h"

namespace selvedge {
namespace {

/// Points of the yarn's curve, close enough that the chain's corners may be any of them; the last is where it
/// begins again.
std::vector<ChainPoint> dense_points(const Yarn& yarn, double step) {
  std::vector<ChainPoint> points;
  for (std::size_t i = 0; i < yarn.segments.size(); ++i) {
    const BezierSegment& segment = yarn.segments[i];
    const int count = std::max(4, static_cast<int>(std::ceil(polygon_length(segment) / step)));
    for (int k = 0; k < count; ++k) {
      const double t = static_cast<double>(k) / count;
      points.push_back({point_at(segment, t), yarn.squeezes.empty() ? V3d(0, 0, 0) : squeeze_at(yarn, i, t)});
    }
  }
  points.push_back({point_at(yarn.segments.back(), 1), points.front().squeeze});
  return points;
}

/// Parts of a segment of the axis that keep plies as near to their helices as chains lie to curves; 0 where
/// none do.
int divisions_for(YarnCurve curve, std::span<const V3f> nodes, const V2f& period,
                  const YarnChainOptions& options) {
  constexpr int most = 64;
  const auto radius = static_cast<double>(ply_or_yarn_radius(curve));
  for (int parts = 1; parts <= most; ++parts) {
    curve.plies.divisions = 2 * parts;
    const bool near = holds_for_plies(curve, nodes, period, [&](std::span<const V3d> ends) {
      for (std::size_t i = 0; i + 2 < ends.size(); i += 2) {
        const V3d half(V3f(ends[i + 1] - ends[i]));
        const V3d whole = half + V3d(V3f(ends[i + 2] - ends[i + 1]));
        if (whole.length() > options.max_length_radii * radius ||
            chord_distance(half, V3d(0), whole) > options.max_sag * radius)
          return false;
      }
      return true;
    });
    if (near) return parts;
  }
  return 0;
}

/// Gives the last curve of `data` the plies of `yarn`; false where a file cannot hold them as a formula:
/// where they turn too often, or pass their yarn's bend so close that a node of theirs lies on the next.
bool give_plies(const Yarn& yarn, const V2f& period, const YarnChainOptions& options, YarnData& data) {
  YarnCurve& curve = data.curves.back();
  const std::span nodes = std::span<const V3f>(data.nodes).last(curve.nodes);
  const PlyTwist course = ply_twist_of(yarn);
  curve.plies = {yarn.plies, 1, course.ply_shift, 0, {0, 0, 0}, 1};
  const Yarns::Segment first = make_segments(curve, nodes, period).front();
  const V3d across(first.across[0]);
  const V3d beside = V3d(course.frames.stations.front().tangent).cross(across);
  const V3d& out = course.frames.stations.front().across;
  curve.plies.phase = static_cast<float>(std::atan2(out.dot(beside), out.dot(across)));
  curve.plies.divisions = divisions_for(curve, nodes, period, options);
  YarnData alone{{curve}, {nodes.begin(), nodes.end()}, {}, {}};
  alone.curves[0].hairs = {};
  alone.station_light.assign(std::size_t{light_values_per_station} * curve.stations, 0);
  return validate(alone, period).has_value();
}

constexpr std::uint64_t stream_hairs = 31;

/// As many hairs as the yarn's hairiness asks for, in the mean over seeds. Refuses more than there is `room`
/// for: throws Failure.
YarnHairs hairs_for(const StitchPattern& pattern, std::size_t index, int room) {
  const Yarn& yarn = pattern.yarns[index];
  YarnHairs hairs;
  const double expected = expected_hairs(yarn);
  if (expected >= room)
    throw Failure{{Code::mesh_invalid, pattern.name, fmt::format("/yarns/{}/hairiness", index),
                   fmt::format("the repeat would have more than {} hairs", max_hairs)}};
  const YarnKind fibre = fibre_or_default(yarn.fibre_kind);
  hairs.count =
      static_cast<int>(expected + Random(hash64(pattern.seed ^ hash64(stream_hairs)), index).uniform());
  if (hairs.count == 0) return hairs;
  hairs.mean_length = static_cast<float>(yarn.hair_mm);
  hairs.loop_fraction = static_cast<float>(yarn.hair_loops);
  hairs.radius = static_cast<float>(0.5e-3 * fibre.diameter_um);
  hairs.opacity = static_cast<float>(1 - forward_transmitted_fraction(fibre.refractive_index));
  return hairs;
}

struct TubeDetail {
  double max_length;  ///< from ring to ring, radii
  int sides;
};
constexpr TubeDetail fine_tubes{0.6, 20};
constexpr TubeDetail coarse_tubes{1.4, 6};

struct Ring {
  V3d centre;
  V3d tangent;
  V3d squeeze;
  double radius;
  double radius_slope;  ///< change of the radius, mm a mm along the tangent
};

std::vector<Ring> rings_of(const Yarn& yarn, const TubeDetail& detail) {
  std::vector<Ring> rings;
  std::vector<double> along;
  double length = 0;
  const double max_length = detail.max_length * yarn.radius_mm;
  for (std::size_t i = 0; i < yarn.segments.size(); ++i) {
    const BezierSegment& segment = yarn.segments[i];
    for (const CurveSpan& span : spans_of(segment, max_length, 0.04 * max_length)) {
      if (rings.empty() || length - along.back() >= 0.6 * max_length) {  // segments may be shorter
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

/// Fine ones, or with up to half the sides, so that there are about 29,000 triangles.
TubeDetail detail_for(const StitchPattern& pattern) {
  std::size_t rings = 0;
  for (const Yarn& yarn : pattern.yarns) rings += rings_of(yarn, fine_tubes).size();
  const double part =
      std::clamp(std::sqrt(29000 / (2.0 * fine_tubes.sides * static_cast<double>(rings))), 0.5, 1.0);
  return {fine_tubes.max_length / part, static_cast<int>(std::lround(fine_tubes.sides * part))};
}

/// The vertex of a ring that lies in a direction of the round section: position, normal, and fibre, along the
/// yarn, turned by its twist at the surface.
void add_vertex(const Yarn& yarn, const Ring& ring, const V3d& round, CellMesh& mesh) {
  const V3d out = squeezed(round, ring.squeeze).normalized();
  mesh.positions.emplace_back(
      ring.centre + stretched(round * round_section_radius(ring.radius, ring.squeeze), ring.squeeze));
  mesh.normals.emplace_back((out - ring.tangent * ring.radius_slope).normalized());
  const double slope = 2 * std::numbers::pi * yarn.radius_mm * yarn.twist_per_mm;
  const V3d axis = squeezed(ring.tangent, ring.squeeze).normalized();
  mesh.fibre_directions.emplace_back(stretched(axis + axis.cross(round) * slope, ring.squeeze).normalized());
}

/// Adds a closed tube, of all but what is the same of each vertex.
void add_tube(const Yarn& yarn, const TubeDetail& detail, CellMesh& mesh) {
  const auto first = static_cast<int>(mesh.positions.size());
  std::vector<V3d> rounds;
  const auto turned = [](const Ring& ring, const V3d& across) {
    const V3d axis = squeezed(ring.tangent, ring.squeeze).normalized();
    return (across - axis * axis.dot(across)).normalized();
  };
  const std::vector<Ring> rings = rings_of(yarn, detail);
  V3d across = std::abs(rings.front().tangent.z) < 0.9 ? V3d(0, 0, 1) : V3d(1, 0, 0);
  for (const Ring& ring : rings) {
    across = turned(ring, across);
    const V3d beside = squeezed(ring.tangent, ring.squeeze).normalized().cross(across);
    for (int k = 0; k < detail.sides; ++k) {
      const double angle = 2 * std::numbers::pi * k / detail.sides;
      rounds.push_back(across * std::cos(angle) + beside * std::sin(angle));
      add_vertex(yarn, ring, rounds.back(), mesh);
    }
  }
  // The first ring once more, from the vertex on that is nearest to the last ring's first.
  const V3d last = turned(rings.front(), across);
  const auto nearest =
      std::max_element(rounds.begin(), rounds.begin() + detail.sides,
                       [&](const V3d& a, const V3d& b) { return last.dot(a) < last.dot(b); });
  const V3f way(yarn.segments.back()[3] - yarn.segments.front()[0]);
  for (int k = 0; k < detail.sides; ++k) {
    const int copied = first + static_cast<int>(nearest - rounds.begin() + k) % detail.sides;
    mesh.positions.push_back(mesh.positions[copied] + way);
    mesh.normals.push_back(mesh.normals[copied]);
    mesh.fibre_directions.push_back(mesh.fibre_directions[copied]);
  }
  for (int r = first; r + detail.sides < static_cast<int>(mesh.positions.size()); r += detail.sides) {
    for (int k = 0; k < detail.sides; ++k) {
      const int next = (k + 1) % detail.sides;
      mesh.triangles.emplace_back(r + k, r + next, r + detail.sides + k);
      mesh.triangles.emplace_back(r + next, r + detail.sides + next, r + detail.sides + k);
    }
  }
}

/// Strands of fibres are not drawn finer than this, in radii: finer strands are not seen apart.
constexpr double min_strand = 0.14;
/// Length over which a strand stays at the surface, in radii.
constexpr double strand_length = 5;

double length_of(const YarnFrames& frames) { return frames.stations.back().arc_length; }

/// Change of rows beyond the repeat over the irregularity of their yarn (by eye).
constexpr float change_of_irregularity = 2;

/// The strands of a chain of yarn or of a ply.
YarnStrands strands_of(const Yarn& yarn, int seed) {
  const double length = length_of(frames_of(yarn, 0.5 * yarn.radius_mm));
  YarnStrands strands{.seed = seed,
                      .irregularity = std::min(static_cast<float>(yarn.irregularity), max_irregularity),
                      .swells = std::clamp(swells_of(length, yarn.radius_mm), 1, max_noise_pieces),
                      .contrast = std::min(static_cast<float>(yarn.melange), max_contrast),
                      .marl = std::min(static_cast<float>(yarn.marl), max_marl)};
  strands.row_variation = std::min(change_of_irregularity * strands.irregularity, max_row_variation);
  if (yarn.fibre_kind == 0) return strands;
  const double width =
      std::max(1e-3 * yarn_kinds()[yarn.fibre_kind].diameter_um, min_strand * yarn.radius_mm);
  strands.count = std::clamp(static_cast<int>(std::lround(2 * std::numbers::pi * yarn.radius_mm / width)), 6,
                             max_strands);
  strands.noise_pieces = std::clamp(static_cast<int>(std::lround(length / (strand_length * yarn.radius_mm))),
                                    2, max_noise_pieces);
  // In whole turns, also where there are more than a file holds.
  const int most = max_noise_pieces / strands.count;
  strands.shift = strands.count * static_cast<int>(std::clamp(std::round(length * yarn.twist_per_mm),
                                                              -1.0 * most, 1.0 * most));
  return strands;
}

/// Chains of a yarn whose plies are no part of one curve.
int chains_of_plies(const Yarn& yarn) {
  return yarn.plies == 1 ? 1 : std::gcd(ply_twist_of(yarn).ply_shift, yarn.plies);
}

/// Albedo for the light that falls on it; light through the wall is part of its indirect light.
V3f surface_albedo(const Yarn& yarn) {
  return V3f(ply_wall_albedo(V3d(yarn.albedo), yarn.transmission) * (1 - yarn.transmission));
}

bool is_varied(const StitchPattern& pattern) {
  return std::ranges::any_of(pattern.yarns, [](const Yarn& yarn) {
    return yarn.fibre_kind != 0 || yarn.irregularity > 0 || yarn.hairiness > 0;
  });
}

/// The curves of a pattern with their strands. `laid`: by lay_plies().
YarnData stranded(const StitchPattern& described, const StitchPattern& laid) {
  YarnData yarns = value_or_throw(yarn_curves_of(described));
  if (!is_varied(laid)) return yarns;
  std::size_t c = 0;
  int chain = 0;
  const auto next_strands = [&] {
    YarnStrands strands = strands_of(laid.yarns[chain], strand_seed(laid.seed, chain));
    ++chain;
    return strands;
  };
  for (const Yarn& yarn : described.yarns) {
    if (yarns.curves[c].plies.count == 1) {
      for (int k = chains_of_plies(yarn); k > 0; --k) yarns.curves[c++].strands = next_strands();
      continue;
    }
    YarnCurve& curve = yarns.curves[c++];
    const YarnPlies& plies = curve.plies;
    const int chains = std::gcd(plies.shift, plies.count);
    const int passes = plies.count / chains;
    const int swells = laid.yarns[chain].swells.swells;
    YarnStrands& strands = curve.strands;
    strands = next_strands();
    chain += chains - 1;
    strands.noise_pieces = std::max(2, strands.noise_pieces / passes);
    strands.swells = strands.irregularity > 0 ? swells : std::max(2, strands.swells / passes);
    const PlyTwist course = ply_twist_of(yarn);
    const double length = length_of(course.frames);
    const double turns = static_cast<double>(plies.shift) / plies.count;
    const double ply = static_cast<double>(ply_or_yarn_radius(curve));
    const double climb = 2 * std::numbers::pi * turns * (static_cast<double>(curve.radius) - ply) / length;
    const double lean = static_cast<double>(curve.fibre_slope) * length / (2 * std::numbers::pi * ply);
    // The frame of the axis turns about a ply by the angle that the ply's course lacks to a flat circle.
    const double lays = lean * std::hypot(1, climb) + turns * (1 - 1 / std::hypot(1, climb));
    strands.shift = static_cast<int>(
        std::lround(std::clamp(lays * strands.count, -1.0 * max_noise_pieces, 1.0 * max_noise_pieces)));
  }
  return yarns;
}

/// The place on the yarn or ply whose surface is the nearest to a vertex.
YarnPlace place_of(const V3f& vertex, const Yarns& yarns) {
  const Yarns::Grid& grid = yarns.grid();
  const std::span<const Yarns::Segment> segments = yarns.geometry().segments;
  const V2f& period = yarns.period();
  const auto cell = [&](int axis) {
    const float repeats = vertex[axis] / period[axis];
    return std::min(static_cast<int>((repeats - std::floor(repeats)) * static_cast<float>(grid.count[axis])),
                    grid.count[axis] - 1);
  };
  const Yarns::Cell& found = grid.cells[std::size_t{1} * cell(1) * grid.count.x + cell(0)];
  YarnHit nearest{-1, V3f(0, 0, 0)};
  float least = std::numeric_limits<float>::max();
  for (const Yarns::Block& block : std::span(grid.blocks).subspan(found.first_block, found.block_count)) {
    for (std::size_t lane = 0; lane < yarn_block_size; ++lane) {
      const Yarns::Segment& s = segments[block.segment[lane]];
      if (!(block.radius[lane] > 0) || s.hair_threshold > 0) continue;
      V3f from_start = vertex - s.start;
      for (int axis = 0; axis < 2; ++axis)
        from_start[axis] -= std::round((from_start[axis] - s.along[axis] / 2) / period[axis]) * period[axis];
      const V3f round = squeezed(from_start, s.squeeze);
      const V3f along = squeezed(s.along, s.squeeze);
      const float fraction = std::clamp(round.dot(along) * s.inverse_length2, 0.0F, 1.0F);
      const float away = (round - along * fraction).length() / s.radius;
      if (away >= least) continue;
      least = away;
      nearest = {block.segment[lane], from_start};
    }
  }
  if (nearest.segment < 0) return {};
  const YarnPoint point = yarns.point_at(nearest);
  const YarnCurve& curve = yarns.data().curves[point.curve];
  return {point.curve, curve.strands.count > 0 ? point.rows.first_row / curve.strands.count : 0,
          point.station / static_cast<float>(curve.stations),
          std::atan2(point.angle_sine, point.angle_cosine) / (2 * std::numbers::pi_v<float>)};
}

/// The hairs of mesh.yarns (format/fabric/yarn_hairs.h), each from the triangle that lies nearest to its
/// root.
Hairs grow_hairs(const CellMesh& mesh) {
  Hairs hairs;
  std::vector<V3d> middles;  // of triangles
  for (const V3i& t : mesh.triangles) {
    V3d& middle =
        middles.emplace_back(V3d(mesh.positions[t.x]) + V3d(mesh.positions[t.y]) + V3d(mesh.positions[t.z]));
    middle /= 3.0;
    for (int i = 0; i < 2; ++i) middle[i] = wrap_to_repeat(middle[i], mesh.period[i]);
  }
  const double side =
      std::sqrt(mesh.period.x * mesh.period.y / (1 + static_cast<double>(middles.size()) / 32));
  const PeriodicGrid grid(std::move(middles), mesh.period, side);
  const auto nearest_triangle = [&](const V3d& point) {
    int nearest = -1;
    double reach = std::numeric_limits<double>::max();
    grid.visit_near(point, reach, [&](int t, const V3d& offset) {
      if (offset.length() >= reach) return;
      reach = offset.length();
      nearest = t;
    });
    return nearest;
  };
  const V2f period(mesh.period);
  for_each_curve(mesh.yarns, [&](std::size_t, const YarnCurve& curve, std::span<const V3f> nodes) {
    if (curve.hairs.count == 0) return;
    for (const YarnHair& hair : make_hairs(curve, nodes, period, make_segments(curve, nodes, period))) {
      const V3d& root = hair.points[0];
      const V3d shift(std::floor(root.x / mesh.period.x) * mesh.period.x,
                      std::floor(root.y / mesh.period.y) * mesh.period.y, 0);
      for (const V3d& point : hair.points) hairs.points.emplace_back(point - shift);
      hairs.root_triangles.push_back(nearest_triangle(root - shift));
      hairs.radius.push_back(curve.hairs.radius);
      hairs.transparency.push_back(1 - curve.hairs.opacity);
    }
  });
  return hairs;
}

/// Nodes of a repeat beyond which they lie farther from their curves, at most twice as far from each other,
/// for 0.3 dB in the middle distance; and beyond which farther still: a viewer's memory grows with them.
constexpr double some_nodes = 1 << 12;
constexpr double many_nodes = 1 << 18;

/// Throws Failure. `has_plies`: else the axes alone.
YarnData chains_of(const StitchPattern& pattern, const YarnChainOptions& options, bool has_plies = true) {
  YarnData data;
  std::optional<StitchPattern> laid;
  std::size_t first_ply = 0;
  int room = max_hairs;
  for (std::size_t y = 0; y < pattern.yarns.size(); ++y) {
    const Yarn& yarn = pattern.yarns[y];
    YarnCurve curve;
    curve.hairs = hairs_for(pattern, y, room);
    room -= curve.hairs.count;
    if (yarn.squeezes.empty()) curve.flattening = static_cast<float>(yarn.flattening);
    curve.squeezes.resize(yarn.squeezes.empty() ? 0 : 1);
    curve.repeat_offset = chain_periods(yarn, pattern.period_mm);
    curve.radius = static_cast<float>(yarn.radius_mm);
    curve.albedo = surface_albedo(yarn);
    curve.gloss = yarn.gloss;
    const double around = 2 * std::numbers::pi * yarn.radius_mm;
    curve.fibre_slope =
        static_cast<float>(yarn.plies > 1 ? std::tan(fibre_angle_in_plies(yarn) * std::numbers::pi / 180)
                                          : around * yarn.twist_per_mm);
    YarnChainOptions own = options;
    if (yarn.plies > 1) own.station_spacing_radii /= 2;  // a ply is about half as thick
    if (!is_round(yarn)) own.max_sag = options.max_flat_sag;
    append_chain(curve, dense_points(yarn, 0.04 * yarn.radius_mm), yarn.radius_mm, own, data);
    const std::size_t own_plies = first_ply;
    const int plies = yarn.plies == 1 ? 1 : std::gcd(ply_twist_of(yarn).ply_shift, yarn.plies);
    first_ply += plies;
    if (yarn.plies == 1 || !has_plies || give_plies(yarn, V2f(pattern.period_mm), options, data)) continue;
    // Each ply as a chain.
    data.nodes.resize(data.nodes.size() - data.curves.back().nodes);
    data.curves.pop_back();
    if (!laid) laid = value_or_throw(lay_plies(pattern, pattern.name));
    StitchPattern alone = pattern;
    const auto from = laid->yarns.begin() + static_cast<std::ptrdiff_t>(own_plies);
    alone.yarns = {from, from + plies};
    const YarnData chains = chains_of(alone, options);
    data.curves.insert(data.curves.end(), chains.curves.begin(), chains.curves.end());
    data.nodes.insert(data.nodes.end(), chains.nodes.begin(), chains.nodes.end());
  }
  return data;
}

/// Times that the yarn is larger than a file holds, or than what readers with usual memory take beside its
/// other layers: it fits up to 1.
double times_too_large(const YarnData& data, const V2f& period) {
  constexpr double few = 0.125;
  constexpr double memory_part = 0.8;
  const double pieces = static_cast<double>(piece_count(data)) / max_piece_count;
  if (pieces <= few || pieces > 1) return pieces;
  return std::max(pieces, yarn_memory_bytes(data, period) / (memory_part * default_memory_limit));
}

/// Throws Failure.
YarnData usual_chains(const StitchPattern& pattern, YarnChainOptions options) {
  const auto nodes = static_cast<double>(chains_of(pattern, options, false).nodes.size());
  const double times = std::max({1.0, std::min(2.0, nodes / some_nodes), nodes / many_nodes});
  for (double* sag : {&options.max_sag, &options.max_flat_sag}) *sag *= times * times;
  return chains_of(pattern, options);
}

}  // namespace

bool hides_plies(const StitchPattern& pattern) {
  constexpr std::size_t max_segments = 1 << 18;  // with them, a mesh takes some 4 kB for each
  std::size_t segments = 0;
  for (const Yarn& yarn : pattern.yarns) segments += yarn.segments.size() * yarn.plies;
  return segments > max_segments;
}

double expected_hairs(const Yarn& yarn) {
  if (yarn.hairiness == 0) return 0;
  // The mean of the cut exponential distribution.
  const double mean = 1 - max_hair_length_ratio / std::expm1(max_hair_length_ratio);
  return yarn.hairiness * polygon_length(yarn.segments) / (mean * yarn.hair_mm);
}

double cut_hairs(StitchPattern& pattern, bool is_rough) {
  // Hairs that any file holds, and those that it holds beside any yarn.
  constexpr double max_hairs_alone = 1 << 16;
  constexpr double max_hairs_beside_much = 1 << 15;
  double hairs = 0;
  for (const Yarn& yarn : pattern.yarns) hairs += expected_hairs(yarn);
  double kept = hairs;
  const auto cut_to = [&](double room) {
    for (Yarn& yarn : pattern.yarns) yarn.hairiness *= room / kept;
    kept = room;
  };
  if (kept > max_hairs_alone) cut_to(max_hairs_alone);
  if (kept > max_hairs_beside_much &&
      (is_rough || times_too_large(usual_chains(pattern, {}), V2f(pattern.period_mm)) > 1))
    cut_to(max_hairs_beside_much);
  return hairs > 0 ? kept / hairs : 1;
}

Result<YarnData> yarn_curves_of(const StitchPattern& pattern, const YarnChainOptions& options) {
  return catch_failure([&] {
    YarnChainOptions own = options;
    YarnData data = usual_chains(pattern, own);
    // Plies of fewer pieces show less than chains farther from their curves.
    int divisions = 0;
    for (const YarnCurve& curve : data.curves) divisions = std::max(divisions, curve.plies.divisions);
    constexpr int max_rounds = 16;
    constexpr double coarser = 1.2;
    for (int round = 0; round < max_rounds; ++round) {
      const double times = times_too_large(data, V2f(pattern.period_mm));
      if (times <= 1) break;
      if (divisions > 1) {
        divisions = std::clamp(static_cast<int>(divisions / times), 1, divisions - 1);
      } else {
        // Chords are as long as the root of their sag.
        for (double* sag : {&own.max_sag, &own.max_flat_sag}) *sag *= std::max(coarser, times * times);
        data = usual_chains(pattern, own);
      }
      for (YarnCurve& curve : data.curves) curve.plies.divisions = std::min(curve.plies.divisions, divisions);
    }
    return data;
  });
}

Result<YarnCell> yarn_cell_of(const StitchPattern& pattern) {
  return catch_failure([&] {
    value_or_throw(validate(pattern, pattern.name));
    YarnCell cell{
        pattern.period_mm, stranded(pattern, value_or_throw(lay_plies(pattern, pattern.name))), {}, 0};
    set_colours(pattern, cell);
    move_to_ground(cell);
    return cell;
  });
}

bool set_colours(const StitchPattern& pattern, YarnCell& cell) {
  auto& curves = cell.yarns.curves;
  for (const Yarn& yarn : pattern.yarns) {
    const std::size_t first = cell.wall_transmission.size();
    if (first >= curves.size()) return false;
    const double t = yarn.transmission;
    cell.wall_transmission.resize(first + (curves[first].plies.count > 1 ? 1 : chains_of_plies(yarn)),
                                  V3f(ply_wall_albedo(V3d(yarn.albedo), t) * t));
    for (std::size_t c = first; c < std::min(cell.wall_transmission.size(), curves.size()); ++c)
      curves[c].albedo = surface_albedo(yarn);
  }
  return cell.wall_transmission.size() == curves.size();
}

Result<CellMesh> mesh_stitch(const StitchPattern& described, bool has_yarns) {
  return catch_failure([&] {
    value_or_throw(validate(described, described.name));
    const bool is_coarse = !has_yarns && hides_plies(described);
    const StitchPattern pattern =
        is_coarse ? described : value_or_throw(lay_plies(described, described.name));
    const auto any = [&](const auto& test) { return std::ranges::any_of(pattern.yarns, test); };
    const bool glossy = any([](const Yarn& yarn) { return yarn.gloss.weight > 0 || yarn.fibre_kind != 0; });
    const bool translucent = any([](const Yarn& yarn) { return yarn.transmission > 0; });
    const TubeDetail detail = is_coarse ? coarse_tubes : detail_for(pattern);
    CellMesh mesh;
    mesh.period = pattern.period_mm;
    for (const Yarn& yarn : pattern.yarns) {
      add_tube(yarn, detail, mesh);
      mesh.albedo.resize(mesh.positions.size(), yarn.albedo);
      if (glossy) mesh.gloss.resize(mesh.positions.size(), yarn.gloss);
      if (translucent) mesh.transmission.resize(mesh.positions.size(), static_cast<float>(yarn.transmission));
    }
    if (!glossy) mesh.fibre_directions.clear();
    if (!has_yarns) return mesh;
    mesh.yarns = stranded(described, pattern);
    if (!is_varied(pattern)) return mesh;
    const Yarns yarns(mesh.yarns, V2f(mesh.period));
    for (const V3f& position : mesh.positions) mesh.yarn_places.push_back(place_of(position, yarns));
    mesh.hairs = grow_hairs(mesh);
    return mesh;
  });
}

}  // namespace selvedge
