#include "converter/export/repeat_mesh.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "format/base/parallel.h"
#include "format/fabric/directions.h"

namespace selvedge {
namespace {

constexpr double pi = std::numbers::pi;
constexpr DirectionGrid lights_above{10, 10};
constexpr int min_sides = 4, min_sides_of_plies = 5, full_sides = 12, min_rings = 4;

/// The segments of a yarn or ply, which follow each other, and how far it bends along them.
struct Chain {
  std::vector<Yarns::Segment> segments;
  std::vector<double> bend;  ///< up to each node: the integral of the root of the curvature
  double length = 0;         ///< mm

  explicit Chain(std::span<const Yarns::Segment> chain) : segments(chain.begin(), chain.end()), bend{0} {
    std::vector<double> lengths{0};
    for (const Yarns::Segment& s : segments) {
      const auto own = static_cast<double>(s.along.length());
      const double cosine = std::clamp(static_cast<double>(s.tangent[0].dot(s.tangent[1])), -1.0, 1.0);
      lengths.push_back(length += own);
      bend.push_back(bend.back() + std::sqrt(std::acos(cosine) * own));
    }
    // Light changes along straight yarn as well: half of the rings are spread evenly.
    const double even = std::max(bend.back(), 1e-9 * length) / length;
    for (std::size_t i = 0; i < bend.size(); ++i) bend[i] += even * lengths[i];
  }
  /// How much it bends, in roots of its radii.
  double winding() const {
    const Yarns::Segment& s = segments.front();
    return bend.back() / 2 / std::sqrt(static_cast<double>(s.radius / thin_radius(1.0F, s.squeeze)));
  }
};

/// A place on a chain.
struct ChainPlace {
  std::size_t segment = 0;
  float share = 0;
  YarnFrame frame;
  V3f round_at(double angle) const {
    return frame.across * static_cast<float>(std::cos(angle)) +
           frame.tangent.cross(frame.across) * static_cast<float>(std::sin(angle));
  }
};

/// The place that this share of the chain's bends leads to; on the smooth curve through its nodes.
ChainPlace place_at(const Chain& chain, double share) {
  const double wanted = share * chain.bend.back();
  const auto next = std::upper_bound(chain.bend.begin() + 1, chain.bend.end() - 1, wanted);
  ChainPlace place;
  place.segment = static_cast<std::size_t>(next - chain.bend.begin()) - 1;
  const double from = chain.bend[place.segment];
  const auto t = static_cast<float>(std::clamp((wanted - from) / (*next - from), 0.0, 1.0));
  const Yarns::Segment& s = chain.segments[place.segment];
  const float rest = 1 - t, length = s.along.length();
  const V3f first = s.tangent[0] * length, second = s.tangent[1] * length;
  const V3f way = s.along * (6 * t * rest) + first * (rest * (1 - 3 * t)) + second * (t * (3 * t - 2));
  place.share = t;
  YarnFrame& frame = place.frame;
  frame.position =
      s.start + s.along * (t * t * (3 - 2 * t)) + first * (t * rest * rest) - second * (t * t * rest);
  // The chain's end is as thick as its begin.
  const Yarns::Segment& section = share < 1 ? s : chain.segments.front();
  frame.squeeze = section.squeeze;
  frame.radius = section.radius;
  frame.tangent = squeezed(way, frame.squeeze).normalized();
  const V3f across = mix(s.across[0], s.across[1], t);
  frame.across = (across - frame.tangent * frame.tangent.dot(across)).normalized();
  return place;
}

/// Fits the cosine of a normal to what a point of the yarn reflects of each light above the cloth.
class Lighting {
 public:
  explicit Lighting(const Yarns& yarns) : yarns_(yarns), lights_(directions_of(lights_above)) {}

  /// Sets a vertex's normal and light, from places about it, each as far as it is seen from above: what lies
  /// at other yarn is not.
  void light(std::span<const YarnHit> hits, V3f& normal, V3f& light) const {
    constexpr float least = 1e-3F;
    std::vector<V3f> reflected(lights_.size(), V3f(0, 0, 0));
    float weights = 0;
    normal = V3f(0, 0, 0);
    for (const YarnHit& hit : hits) {
      const YarnPoint point = yarns_.point_at(hit);
      std::vector<float> cosines;
      float seen = least;
      for (const V3f& l : lights_) {
        const float cosine = std::max(0.0F, point.normal.dot(l));
        cosines.push_back(cosine > 0 && !yarns_.occluded(hit, point, l) ? cosine : 0);
        seen += cosines.back() * l.z / static_cast<float>(lights_.size());
      }
      const LightTransfer transfer = yarns_.transfer_at(point);
      const V3f albedo = yarns_.data().curves[point.curve].albedo * std::numbers::inv_pi_v<float>;
      for (std::size_t i = 0; i < lights_.size(); ++i)
        reflected[i] += (indirect_light(transfer, lights_[i]) + albedo * cosines[i]) * seen;
      normal += point.normal * seen;
      weights += seen;
    }
    normal.normalize();
    const YarnPoint point = yarns_.point_at(hits.front());
    const YarnCurve& curve = yarns_.data().curves[point.curve];
    YarnStrands shades = curve.strands;  // of plies and lengths; single strands are too thin for vertices
    shades.contrast = 0;
    light = curve.albedo;
    // Seen from behind alone, it is as it is lit from there, without other yarn.
    if (weights > least * static_cast<float>(hits.size()) || normal.z >= 0) {
      normal = normal_for(reflected, normal);
      light = V3f(0, 0, 0);
      float squares = 0;
      for (std::size_t i = 0; i < lights_.size(); ++i) {
        const float cosine = std::max(0.0F, normal.dot(lights_[i]));
        light += reflected[i] * (cosine * lights_[i].z);
        squares += cosine * cosine * lights_[i].z;
      }
      light *= squares > 0 ? std::numbers::pi_v<float> / (squares * weights) : 0;
    }
    light *= strand_change(shades, 0.0F, point.station / static_cast<float>(curve.stations), point.rows)
                 .brightness;
  }

 private:
  /// The unit vector whose cosines are nearest to the brightness, by least squares over the lights that it
  /// faces.
  V3f normal_for(const std::vector<V3f>& reflected, V3f normal) const {
    for (int round = 0; round < 4; ++round) {
      Eigen::Matrix3f squares = Eigen::Matrix3f::Identity() * 1e-3F;
      Eigen::Vector3f sum(0, 0, 0);
      for (std::size_t i = 0; i < lights_.size(); ++i) {
        if (round > 0 && !(normal.dot(lights_[i]) > 0)) continue;
        const Eigen::Vector3f l(lights_[i].x, lights_[i].y, lights_[i].z);
        squares += l * l.transpose() * l.z();
        sum += l * (l.z() * (reflected[i].x + reflected[i].y + reflected[i].z));
      }
      const Eigen::Vector3f best = squares.ldlt().solve(sum);
      if (!(best.squaredNorm() > 0)) break;
      normal = V3f(best.x(), best.y(), best.z()).normalized();
    }
    return normal;
  }

  const Yarns& yarns_;
  std::vector<V3f> lights_;
};

/// Hairs are not drawn, and would hide light as if they were all as thick as they are.
Yarns without_hairs(const Yarns& yarns) {
  YarnData data = yarns.data();
  for (YarnCurve& curve : data.curves) curve.hairs.count = 0;
  return {std::move(data), yarns.period()};
}

/// A curve's axis and plies.
struct CurveChains {
  Chain axis;
  std::vector<Chain> plies;
  int first_segment = 0;  ///< of the first ply, in Yarns

  double full_triangles() const {
    double sum = 0;
    for (const Chain& ply : plies)
      sum += std::max(full_sides * full_sides * ply.winding() / pi, 2.0 * full_sides * min_rings);
    return sum;
  }
};

/// Precondition: no hairs.
std::vector<CurveChains> chains_of(const Yarns& yarns) {
  std::vector<CurveChains> chains;
  int first = 0;
  for_each_curve(yarns.data(), [&](std::size_t, const YarnCurve& curve, std::span<const V3f> nodes) {
    YarnCurve bare = curve;
    bare.plies = {};
    chains.push_back({Chain(segments_of(bare, nodes, yarns.period())), {}, first});
    const int each = curve.nodes * curve.plies.divisions;
    for (int ply = 0; ply < curve.plies.count; ++ply, first += each)
      chains.back().plies.emplace_back(yarns.inside().segments.subspan(first, each));
  });
  return chains;
}

class TubeBuilder {
 public:
  explicit TubeBuilder(const Yarns& yarns)
      : yarns_(without_hairs(yarns)), lighting_(yarns_), chains_(chains_of(yarns_)) {}

  RepeatMesh build(double triangles) {
    RepeatMesh mesh;
    double length = 0;
    for (const CurveChains& chains : chains_) length += chains.axis.length;
    const auto& curves = yarns_.data().curves;
    for (std::size_t c = 0; c < chains_.size(); ++c) {
      auto tubes = std::ranges::find_if(mesh, [&](const YarnTubes& other) {
        return curves[other.curve].albedo == curves[c].albedo && curves[other.curve].gloss == curves[c].gloss;
      });
      if (tubes == mesh.end()) tubes = mesh.insert(tubes, {static_cast<int>(c), {}});
      const double own = triangles * chains_[c].axis.length / length;
      const std::size_t plies = chains_[c].plies.size();
      const double of_ply = own / static_cast<double>(plies);
      if (plies > 1 && sides_of(chains_[c].plies[0], of_ply) >= min_sides_of_plies) {
        for (std::size_t p = 0; p < plies; ++p)
          add_tube(chains_[c], chains_[c].plies[p], static_cast<int>(p), of_ply, tubes->mesh);
      } else {
        add_tube(chains_[c], chains_[c].axis, -1, own, tubes->mesh);
      }
    }
    return mesh;
  }

 private:
  // With these a tube is as far from the yarn around it as along it: chords of K rings, which share the bends
  // evenly, lie bend^2 / 8 K^2 within the curve, chords of n sides r pi^2 / 2 n^2 within the circle; 2 n K
  // are the triangles.
  static int sides_of(const Chain& chain, double triangles) {
    const double best = std::min(std::sqrt(pi * triangles / chain.winding()), triangles / (2 * min_rings));
    return std::clamp(static_cast<int>(best), min_sides, full_sides);
  }

  /// On the ply; -1: on the one that lies outermost that way from the axis.
  static YarnHit hit_of(const CurveChains& chains, int ply, const ChainPlace& place, const V3f& round) {
    const std::size_t each = chains.plies[0].segments.size();
    float share = place.share;
    std::size_t segment = place.segment;
    if (ply < 0) {
      const std::size_t divisions = each / chains.axis.segments.size();
      share *= static_cast<float>(divisions);
      const auto within = std::min(divisions - 1, static_cast<std::size_t>(share));
      segment = segment * divisions + within;
      share -= static_cast<float>(within);
      const auto facing = [&](const Chain& one) { return one.segments[segment].out[0].dot(round); };
      ply = static_cast<int>(std::ranges::max_element(chains.plies, {}, facing) - chains.plies.begin());
    }
    const Yarns::Segment& s = chains.plies[ply].segments[segment];
    return {chains.first_segment + ply * static_cast<int>(each) + static_cast<int>(segment),
            s.along * share + stretched(round, s.squeeze) * s.radius};
  }

  void add_tube(const CurveChains& chains, const Chain& chain, int ply, double triangles,
                TubeMesh& mesh) const {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    const int sides = sides_of(chain, triangles);
    const int rings = std::max(min_rings, static_cast<int>(triangles / (2 * sides)));
    // As wide in the mean as the circle.
    const auto wider = static_cast<float>(pi / (sides * std::sin(pi / sides)));
    for (int i = 0; i < (rings + 1) * sides; ++i) {
      const int ring = i / sides;
      const ChainPlace place = place_at(chain, double{1} * ring / rings);
      mesh.positions.push_back(place.frame.place_of(place.round_at(2 * pi * (i % sides) / sides) * wider));
    }
    mesh.light.resize(mesh.positions.size());
    mesh.normals.resize(mesh.positions.size());
    parallel_for(0, (rings + 1) * sides, [&](int i) {
      const int ring = i / sides;
      std::vector<YarnHit> hits;
      for (const double along : {-0.25, 0.25}) {
        const double share = (ring + along) / rings;
        const ChainPlace place = place_at(chain, share - std::floor(share));
        for (const double around : {-0.25, 0.25})
          hits.push_back(hit_of(chains, ply, place, place.round_at(2 * pi * (i % sides + around) / sides)));
      }
      const std::size_t vertex = first + static_cast<std::size_t>(i);
      lighting_.light(hits, mesh.normals[vertex], mesh.light[vertex]);
    });
    for (int i = 0; i < rings * sides; ++i) {
      const std::uint32_t a = first + static_cast<std::uint32_t>(i),
                          round = static_cast<std::uint32_t>(sides);
      const std::uint32_t b = (i + 1) % sides == 0 ? a + 1 - round : a + 1;
      mesh.indices.insert(mesh.indices.end(), {a, b, a + round, b, b + round, a + round});
    }
  }

  Yarns yarns_;
  Lighting lighting_;
  std::vector<CurveChains> chains_;
};

}  // namespace

RepeatMesh mesh_of_repeat(const Yarns& yarns, double triangles) {
  return TubeBuilder(yarns).build(triangles);
}

std::int64_t triangles_of(const RepeatMesh& mesh) {
  std::size_t sum = 0;
  for (const YarnTubes& tubes : mesh) sum += tubes.mesh.indices.size() / 3;
  return static_cast<std::int64_t>(sum);
}

double min_triangles(const Yarns& yarns) {
  return 2.0 * min_sides * min_rings * static_cast<double>(yarns.data().curves.size());
}

double max_triangles(const Yarns& yarns) {
  double sum = 0;
  for (const CurveChains& chains : chains_of(without_hairs(yarns))) sum += chains.full_triangles();
  return sum;
}

std::vector<YarnJoint> joints_of(const Yarns& yarns) {
  constexpr int places = 24;        // of an axis
  constexpr float touching = 1.2F;  // of the sum of the radii: places lie apart
  constexpr int reach = 2;          // repeats
  const V2f& period = yarns.period();
  const auto& curves = yarns.data().curves;
  const std::vector<CurveChains> chains = chains_of(without_hairs(yarns));
  std::vector<YarnJoint> joints;
  const auto place_of = [&](std::size_t c, int i) {
    return place_at(chains[c].axis, static_cast<double>(i) / places).frame.position;
  };
  for (std::size_t c = 0; c < chains.size(); ++c) {
    const V2i turns = curves[c].turns;
    if (turns != V2i(0, 0)) {
      joints.push_back({place_of(c, places), place_of(c, 0), turns, curves[c].radius, true});
      joints.push_back({place_of(c, 0), place_of(c, places), -turns, curves[c].radius, true});
    }
    for (int i = 0; i < places; ++i) {
      YarnJoint nearest{place_of(c, i), {0, 0, 0}, {0, 0}, curves[c].radius};
      float least = touching;
      for (std::size_t o = 0; o < chains.size(); ++o) {
        for (int k = 0; k < places * (2 * reach + 1) * (2 * reach + 1); ++k) {
          const V2i repeat(k % (2 * reach + 1) - reach, k / (2 * reach + 1) % (2 * reach + 1) - reach);
          // Yarn that goes on touches its own.
          if (repeat == V2i(0, 0) || (o == c && repeat.x * turns.y == repeat.y * turns.x)) continue;
          const V3f other = place_of(o, k / ((2 * reach + 1) * (2 * reach + 1)));
          const V3f shift(static_cast<float>(repeat.x) * period.x, static_cast<float>(repeat.y) * period.y,
                          0);
          const float distance =
              (nearest.own - other - shift).length() / (curves[c].radius + curves[o].radius);
          if (distance >= least) continue;
          least = distance;
          nearest.other = other;
          nearest.repeat = repeat;
        }
      }
      if (least < touching) joints.push_back(nearest);
    }
  }
  return joints;
}

Imath::Box2d reach_of(const Yarns& yarns) {
  Imath::Box2d reach;
  for (const Yarns::Segment& s : yarns.inside().segments) {
    if (s.rank > 0) continue;
    const V3f wide(reach_of(s.reach, s.squeeze, V3f(1, 0, 0)), reach_of(s.reach, s.squeeze, V3f(0, 1, 0)), 0);
    for (const V3f& p : {s.start - wide, s.start + wide, s.start + s.along - wide, s.start + s.along + wide})
      reach.extendBy(V2d(p.x / yarns.period().x, -p.y / yarns.period().y));
  }
  return reach;
}

}  // namespace selvedge
