#include "converter/export/repeat_mesh.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "format/base/parallel.h"
#include "format/fabric/directions.h"

namespace selvedge {
namespace {

constexpr double pi = std::numbers::pi;
constexpr DirectionGrid lights_above{10, 10};
constexpr int min_sides = 4, full_sides = 12, min_rings = 4;
constexpr int min_sides_of_ply = 4, full_sides_of_ply = 8;

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
    return bend.back() / 2 / std::sqrt(static_cast<double>(s.radius / round_section_radius(1.0F, s.squeeze)));
  }
};

/// A place on a chain.
struct ChainPlace {
  std::size_t segment = 0;
  float fraction = 0;
  YarnFrame frame;
  V3f round_at(double angle) const {
    return frame.across * static_cast<float>(std::cos(angle)) +
           frame.tangent.cross(frame.across) * static_cast<float>(std::sin(angle));
  }
};

/// The place that this fraction of the chain's bends leads to; on the smooth curve through its nodes.
ChainPlace place_at(const Chain& chain, double fraction) {
  const double wanted = fraction * chain.bend.back();
  const auto next = std::upper_bound(chain.bend.begin() + 1, chain.bend.end() - 1, wanted);
  ChainPlace place;
  place.segment = static_cast<std::size_t>(next - chain.bend.begin()) - 1;
  const double from = chain.bend[place.segment];
  const auto t = static_cast<float>(std::clamp((wanted - from) / (*next - from), 0.0, 1.0));
  const Yarns::Segment& s = chain.segments[place.segment];
  const float rest = 1 - t, length = s.along.length();
  const V3f first = s.tangent[0] * length, second = s.tangent[1] * length;
  const V3f way = s.along * (6 * t * rest) + first * (rest * (1 - 3 * t)) + second * (t * (3 * t - 2));
  place.fraction = t;
  YarnFrame& frame = place.frame;
  frame.position =
      s.start + s.along * (t * t * (3 - 2 * t)) + first * (t * rest * rest) - second * (t * t * rest);
  // The chain's end is as thick as its begin.
  const Yarns::Segment& section = fraction < 1 ? s : chain.segments.front();
  frame.squeeze = section.squeeze;
  frame.radius = section.radius;
  frame.tangent = squeezed(way, frame.squeeze).normalized();
  const V3f across = mix(s.across[0], s.across[1], t);
  frame.across = (across - frame.tangent * frame.tangent.dot(across)).normalized();
  return place;
}

/// The light that points of the yarn reflect, for each light above the cloth.
class Lighting {
 public:
  explicit Lighting(const Yarns& yarns) : yarns_(yarns), lights_(cell_directions(lights_above)) {}

  /// The normal whose cosines come nearest to what places about a vertex reflect, each as far as it is seen
  /// from above: what lies at other yarn is not.
  V3f normal_at(std::span<const YarnHit> hits) const {
    std::vector<V3f> reflected(lights_.size(), V3f(0, 0, 0));
    V3f normal(0, 0, 0);
    for (const YarnHit& hit : hits) {
      const Reflection one = reflection_of({&hit, 1});
      for (std::size_t i = 0; i < lights_.size(); ++i) reflected[i] += one.light[i] * one.seen;
      normal += one.point.normal * one.seen;
    }
    normal.normalize();
    constexpr float from_behind = -0.5F;  // there it has the normal of the yarn
    return normal.z < from_behind ? normal : normal_for(reflected, normal);
  }

  struct Shown {
    V3f color{0, 0, 0};  ///< of the picture
    float fraction = 0;  ///< in [0, 1]: 0 where other yarn hides it from above
    float seen = 0;      ///< weight in the mean of what is seen
  };
  /// The mean of some places on a surface with such a normal.
  Shown shown_at(std::span<const YarnHit> hits, const V3f& normal) const {
    constexpr float mostly_seen = 0.02F, min_squares = 0.02F;
    const Reflection one = reflection_of(hits);
    V3f sum(0, 0, 0);
    float squares = 0;
    for (std::size_t i = 0; i < lights_.size(); ++i) {
      const float cosine = std::max(0.0F, normal.dot(lights_[i]));
      sum += one.light[i] * (cosine * lights_[i].z);
      squares += cosine * cosine * lights_[i].z;
    }
    if (!(squares > min_squares * static_cast<float>(lights_.size()))) return {};
    return {sum * (std::numbers::pi_v<float> / squares), std::min(1.0F, one.seen / mostly_seen), one.seen};
  }

 private:
  static constexpr float min_seen = 1e-3F;

  struct Reflection {
    YarnPoint point;
    std::vector<V3f> light;  ///< 1/sr
    float seen = min_seen;   ///< by views about the cloth's normal, as most of a garment is seen
  };

  /// Mean over some places, which other yarn hides as it hides the first; as seen from above.
  Reflection reflection_of(std::span<const YarnHit> hits) const {
    Reflection result{yarns_.point_at(hits.front()), std::vector<V3f>(lights_.size(), V3f(0, 0, 0))};
    const V3f normal = result.point.normal, view(0, 0, 1);
    std::vector<bool> lit;
    for (const V3f& l : lights_) {
      lit.push_back(normal.dot(l) > 0 && !yarns_.is_occluded(hits.front(), result.point, l));
      if (lit.back()) result.seen += normal.dot(l) * std::pow(l.z, 4.0F) / static_cast<float>(lights_.size());
    }
    const float fraction = 1 / static_cast<float>(hits.size());
    for (const YarnHit& hit : hits) {
      YarnPoint point = yarns_.point_at(hit);
      yarns_.perturb_by_strands(point, view);
      const LightTransfer transfer = yarns_.transfer_at(point);
      const float factor = point.brightness * yarns_.lustre_view_factor(point, view) * fraction;
      for (std::size_t i = 0; i < lights_.size(); ++i) {
        result.light[i] += indirect_light(transfer, lights_[i]) * factor;
        if (lit[i]) result.light[i] += yarns_.direct_reflectance(point, lights_[i], view) * fraction;
      }
    }
    return result;
  }

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

/// A corner of a tube's section.
struct SectionCorner {
  double angle = 0;  ///< about the axis
  float reach = 1;   ///< in radii
};

/// A curve's axis and the plies about it.
class PliedCurve {
 public:
  Chain axis;

  PliedCurve(const Yarns& yarns, const YarnCurve& curve, Chain chain, int first_segment)
      : axis(std::move(chain)),
        plies_(curve.plies),
        radius_(static_cast<float>(unit_ply_radius(plies_.count))),
        first_segment_(first_segment),
        segments_(yarns.geometry().segments) {}

  int plies() const { return plies_.count; }
  /// Radians, of the plies about the axis along the curve.
  double twist() const { return 2 * pi * plies_.shift / plies_.count; }

  /// The angle of the first ply about the axis; it continues beyond pi.
  double turn_at(const ChainPlace& place) const {
    if (plies_.count == 1) return 0;
    const auto [segment, fraction] = ply_at(0, place);
    const V3f out = mix(segment->axis_to_ply[0], segment->axis_to_ply[1], fraction);
    const double turn =
        std::atan2(out.dot(place.frame.tangent.cross(place.frame.across)), out.dot(place.frame.across));
    const double near = static_cast<double>(plies_.phase) +
                        twist() * (static_cast<double>(place.segment) + static_cast<double>(place.fraction)) /
                            static_cast<double>(axis.segments.size());
    return near + std::remainder(turn - near, 2 * pi);
  }

  /// How far the plies reach from the axis at an angle from one of them, in radii of the yarn.
  float reach_at(float cosine) const {
    const float away = 1 - radius_;
    return away * cosine + std::sqrt(std::max(0.0F, radius_ * radius_ - away * away * (1 - cosine * cosine)));
  }

  /// One of `corners` corners from where a ply meets the one before it to where it meets the next; the angle
  /// is from the first ply.
  SectionCorner corner_of(int ply, int corner, int corners) const {
    const double between = pi / plies_.count, half = pi / 2 + between, side = half / corners;
    if (corner == 0)
      return {2 * between * ply - between, static_cast<float>((1 - double{radius_}) * std::cos(between))};
    const double about = 2 * side * corner - half, wide = radius_ * side / std::sin(side);
    const double x = 1 - radius_ + wide * std::cos(about), y = wide * std::sin(about);
    return {2 * between * ply + std::atan2(y, x), static_cast<float>(std::hypot(x, y))};
  }

  /// The plies' surface at an angle about the axis.
  YarnHit hit_at(const ChainPlace& place, double angle) const {
    const V3f round = place.round_at(angle);
    int facing = 0;
    float most = -1;
    for (int ply = 0; ply < plies_.count; ++ply) {
      const auto [segment, fraction] = ply_at(ply, place);
      const float cosine = mix(segment->axis_to_ply[0], segment->axis_to_ply[1], fraction).dot(round);
      if (cosine > most) std::tie(facing, most) = std::pair(ply, cosine);
    }
    const auto [segment, fraction] = ply_at(facing, place);
    const Yarns::Segment& s = *segment;
    const V3f way = squeezed(s.along, s.squeeze) * std::sqrt(s.inverse_length2);
    V3f across = round * reach_at(most) - mix(s.axis_to_ply[0], s.axis_to_ply[1], fraction) * (1 - radius_);
    across = (across - way * way.dot(across)).normalized();
    return {static_cast<int>(segment - segments_.data()),
            s.along * fraction + stretched(across, s.squeeze) * s.radius};
  }

 private:
  std::pair<const Yarns::Segment*, float> ply_at(int ply, const ChainPlace& place) const {
    const std::size_t divisions = plies_.divisions;
    const float part = place.fraction * static_cast<float>(divisions);
    const auto within = std::min(divisions - 1, static_cast<std::size_t>(part));
    const std::size_t segment = (ply * axis.segments.size() + place.segment) * divisions + within;
    return {&segments_[first_segment_ + segment], part - static_cast<float>(within)};
  }

  YarnPlies plies_;
  float radius_;  ///< of a ply, in radii of the yarn
  std::size_t first_segment_;
  std::span<const Yarns::Segment> segments_;
};

/// Precondition: no hairs.
std::vector<PliedCurve> curves_of(const Yarns& yarns) {
  std::vector<PliedCurve> curves;
  int first = 0;
  for_each_curve(yarns.data(), [&](std::size_t, const YarnCurve& curve, std::span<const V3f> nodes) {
    YarnCurve bare = curve;
    bare.plies = {};
    curves.emplace_back(yarns, curve, Chain(make_segments(bare, nodes, yarns.period())), first);
    first += static_cast<int>(segment_count(curve));
  });
  return curves;
}

/// How a curve becomes a tube. With these a round one is as far from the yarn around it as along it: chords
/// of K rings, which share the bends evenly, lie bend^2 / 8 K^2 within the curve, chords of n sides r pi^2 /
/// 2 n^2 within the circle; 2 n K are the triangles. Where they suffice, the sides follow the plies.
struct Tube {
  const PliedCurve* curve = nullptr;
  int rings = min_rings;
  bool shows_plies = false;
  std::vector<SectionCorner> section;  ///< the last corner is the first, after a whole turn
  std::ptrdiff_t group = 0;            ///< MergedTubes
  int first_row = 0, rows = 0;         ///< of the picture

  Tube(const PliedCurve& own, double triangles) : curve(&own) {
    const int plies = own.plies();
    for (int of_ply = full_sides_of_ply; of_ply >= min_sides_of_ply && plies > 1; --of_ply) {
      rings = std::max(
          {min_rings, rings_of(of_ply * plies), static_cast<int>(of_ply * std::abs(own.twist()) / pi)});
      shows_plies = 2.0 * of_ply * plies * rings <= triangles;
      if (!shows_plies) continue;
      for (int i = 0; i <= of_ply * plies; ++i)
        section.push_back(own.corner_of(i / of_ply, i % of_ply, of_ply));
      return;
    }
    const double best = std::min(std::sqrt(pi * triangles / own.axis.winding()), triangles / (2 * min_rings));
    const int count = std::clamp(static_cast<int>(best), min_sides, full_sides);
    rings = static_cast<int>(triangles / (2 * count));
    if (count == full_sides) rings = std::min(rings, rings_of(count));
    rings = std::max(min_rings, rings);
    // As wide in the mean as the circle.
    const double wider = pi / (count * std::sin(pi / count));
    for (int i = 0; i <= count; ++i) section.push_back({2 * pi * i / count, static_cast<float>(wider)});
  }

  int sides() const { return static_cast<int>(section.size()) - 1; }
  /// Rings as near to the curve as this number of sides is to its section.
  int rings_of(int count) const { return static_cast<int>(count * curve->axis.winding() / (2 * pi)); }
  /// Where angles of the section count from.
  double first_angle(double turn) const { return shows_plies ? turn : 0; }
  double angle_at(double side) const {
    const double whole = std::floor(side / sides()), within = side - whole * sides();
    const int i = std::min(static_cast<int>(within), sides() - 1);
    return 2 * pi * whole + section[i].angle + (section[i + 1].angle - section[i].angle) * (within - i);
  }
  /// The inverse, in [0, sides].
  double side_at(double angle) const {
    const double within = angle - 2 * pi * std::floor((angle - section[0].angle) / (2 * pi));
    const auto next =
        std::ranges::upper_bound(section.begin() + 1, section.end() - 1, within, {}, &SectionCorner::angle);
    const SectionCorner& from = *(next - 1);
    return static_cast<double>(next - section.begin() - 1) +
           std::clamp((within - from.angle) / (next->angle - from.angle), 0.0, 1.0);
  }
  std::size_t vertex(int ring, int side) const {
    return static_cast<std::size_t>(ring) * section.size() + static_cast<std::size_t>(side);
  }
};

class TubeBuilder {
 public:
  explicit TubeBuilder(const Yarns& yarns)
      : yarns_(without_hairs(yarns)), lighting_(yarns_), curves_(curves_of(yarns_)) {}

  RepeatMesh build(double triangles, double pixels) const {
    RepeatMesh mesh;
    std::vector<Tube> tubes;
    double length = 0, area = 0, widest = 0;
    for (const PliedCurve& curve : curves_) length += curve.axis.length;
    const auto& data = yarns_.data().curves;
    for (std::size_t c = 0; c < curves_.size(); ++c) {
      Tube& tube = tubes.emplace_back(curves_[c], triangles * curves_[c].axis.length / length);
      auto group = std::ranges::find_if(mesh.tubes, [&](const MergedTubes& other) {
        return data[other.first_curve].albedo == data[c].albedo &&
               data[other.first_curve].gloss == data[c].gloss;
      });
      if (group == mesh.tubes.end()) group = mesh.tubes.insert(group, {static_cast<int>(c), {}});
      tube.group = group - mesh.tubes.begin();
      const double girth = 2 * pi * static_cast<double>(data[c].radius);
      area += girth * curves_[c].axis.length;
      widest = std::max(widest, girth);
    }
    Image& picture = mesh.picture;
    picture.channels = 3;
    picture.width = std::max(min_sides, static_cast<int>(widest / std::sqrt(area / pixels)));
    const double row = length * picture.width / pixels;  // mm
    for (Tube& tube : tubes) {
      tube.first_row = picture.height + margin;
      tube.rows = std::max(min_rings, static_cast<int>(tube.curve->axis.length / row));
      picture.height = tube.first_row + tube.rows + margin;
    }
    picture.pixels.resize(std::size_t{3} * picture.width * picture.height);
    for (const Tube& tube : tubes) {
      TubeMesh& group = mesh.tubes[tube.group].mesh;
      const std::size_t first = group.positions.size();
      add_tube(tube, picture.height, group);
      paint(tube, std::span(group.normals).subspan(first), picture);
    }
    return mesh;
  }

 private:
  static constexpr int margin = 2;  ///< rows of a tube's picture beyond either end

  void add_tube(const Tube& tube, int height, TubeMesh& mesh) const {
    const int sides = tube.sides(), rings = tube.rings;
    const PliedCurve& curve = *tube.curve;
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    const std::size_t count = first + tube.vertex(rings + 1, 0);
    mesh.positions.resize(count);
    mesh.normals.resize(count);
    mesh.tex_coords.resize(count);
    parallel_for(0, (rings + 1) * (sides + 1), [&](int i) {
      const int ring = i / (sides + 1), side = i % (sides + 1);
      const std::size_t vertex = first + static_cast<std::size_t>(i);
      const double fraction = double{1} * ring / rings;
      const ChainPlace place = place_at(curve.axis, fraction);
      const double turn = curve.turn_at(place), from = tube.first_angle(turn);
      const auto& [angle, reach] = tube.section[side];
      mesh.positions[vertex] =
          place.frame.surface_position(place.round_at(from + tube.section[side % sides].angle) * reach);
      mesh.tex_coords[vertex] =
          V2f(V2d((from + angle - turn) / (2 * pi), (tube.first_row + fraction * tube.rows) / height));
      std::vector<YarnHit> hits;
      for (const double along : {-0.25, 0.25}) {
        const double at = (ring + along) / rings;
        const ChainPlace beside = place_at(curve.axis, at - std::floor(at));
        const double begin = tube.first_angle(curve.turn_at(beside));
        for (const double around : {-0.25, 0.25})
          hits.push_back(curve.hit_at(beside, begin + tube.angle_at(side % sides + around)));
      }
      mesh.normals[vertex] = lighting_.normal_at(hits);
    });
    for (int i = 0; i < rings * sides; ++i) {
      const auto at = [&](int ring, int side) {
        return first + static_cast<std::uint32_t>(tube.vertex(i / sides + ring, i % sides + side));
      };
      mesh.indices.insert(mesh.indices.end(), {at(0, 0), at(0, 1), at(1, 0), at(0, 1), at(1, 1), at(1, 0)});
    }
  }

  /// The tube's rows of the picture, from the first ply around. Places that are hidden have the color that
  /// gives smaller pictures the mean of what is seen.
  void paint(const Tube& tube, std::span<const V3f> normals, Image& picture) const {
    const PliedCurve& curve = *tube.curve;
    std::vector<Lighting::Shown> shown(std::size_t{1} * tube.rows * picture.width);
    parallel_for(0, tube.rows, [&](int row) {
      const double fraction = (row + 0.5) / tube.rows, along = fraction * tube.rings;
      const ChainPlace place = place_at(curve.axis, fraction);
      const double turn = curve.turn_at(place);
      const int ring = static_cast<int>(along);
      for (int x = 0; x < picture.width; ++x) {
        const double angle = turn + 2 * pi * (x + 0.5) / picture.width;
        const double at = tube.side_at(angle - tube.first_angle(turn));
        const int side = std::min(static_cast<int>(at), tube.sides() - 1);
        const auto normal_on = [&](int r) {
          return mix(normals[tube.vertex(r, side)], normals[tube.vertex(r, side + 1)],
                     static_cast<float>(at - side));
        };
        const V3f normal = mix(normal_on(ring), normal_on(ring + 1), static_cast<float>(along - ring));
        std::vector<YarnHit> hits{curve.hit_at(place, angle)};
        for (const double up : {-0.25, 0.25}) {
          const ChainPlace beside = place_at(curve.axis, fraction + up / tube.rows);
          for (const double around : {-0.25, 0.25})
            hits.push_back(curve.hit_at(beside, angle + 2 * pi * around / picture.width));
        }
        shown[std::size_t{1} * row * picture.width + x] = lighting_.shown_at(hits, normal.normalized());
      }
    });
    V3d seen(0, 0, 0), kept(0, 0, 0);
    double weight = 0, hidden = 0;
    for (const Lighting::Shown& one : shown) {
      seen += V3d(one.color) * static_cast<double>(one.seen);
      weight += static_cast<double>(one.seen);
      kept += V3d(one.color * one.fraction);
      hidden += 1 - static_cast<double>(one.fraction);
    }
    V3f rest(0, 0, 0);
    if (hidden > 0 && weight > 0)
      rest = V3f((seen / weight * static_cast<double>(shown.size()) - kept) / hidden);
    for (int row = -margin; row < tube.rows + margin; ++row) {
      for (int x = 0; x < picture.width; ++x) {
        const Lighting::Shown& one =
            shown[std::size_t{1} * std::clamp(row, 0, tube.rows - 1) * picture.width + x];
        const V3f color = mix(rest, one.color, one.fraction);
        for (int k = 0; k < 3; ++k)
          picture.pixels[3 * ((tube.first_row + row) * picture.width + x) + k] = std::max(0.0F, color[k]);
      }
    }
  }

  Yarns yarns_;
  Lighting lighting_;
  std::vector<PliedCurve> curves_;
};

}  // namespace

RepeatMesh mesh_of_repeat(const Yarns& yarns, double triangles, double pixels) {
  return TubeBuilder(yarns).build(triangles, pixels);
}

std::int64_t mesh_triangle_count(const RepeatMesh& mesh) {
  std::size_t sum = 0;
  for (const MergedTubes& tubes : mesh.tubes) sum += tubes.mesh.indices.size() / 3;
  return static_cast<std::int64_t>(sum);
}

double min_triangles(const Yarns& yarns) {
  return 2.0 * min_sides * min_rings * static_cast<double>(yarns.data().curves.size());
}

double max_triangles(const Yarns& yarns) {
  double sum = 0;
  const Yarns bare = without_hairs(yarns);
  for (const PliedCurve& curve : curves_of(bare)) {
    const Tube full(curve, 1e9);
    sum += 2.0 * full.sides() * full.rings;
  }
  return sum;
}

std::vector<YarnJoint> joints_of(const Yarns& yarns) {
  constexpr int places = 24;        // of an axis
  constexpr float touching = 1.2F;  // of the sum of the radii: places lie apart
  constexpr int reach = 2;          // repeats
  const V2f& period = yarns.period();
  const auto& curves = yarns.data().curves;
  const Yarns bare = without_hairs(yarns);
  const std::vector<PliedCurve> plied = curves_of(bare);
  std::vector<YarnJoint> joints;
  const auto place_of = [&](std::size_t c, int i) {
    return place_at(plied[c].axis, static_cast<double>(i) / places).frame.position;
  };
  for (std::size_t c = 0; c < plied.size(); ++c) {
    const V2i turns = curves[c].repeat_offset;
    if (turns != V2i(0, 0)) {
      joints.push_back({place_of(c, places), place_of(c, 0), turns, curves[c].radius, true});
      joints.push_back({place_of(c, 0), place_of(c, places), -turns, curves[c].radius, true});
    }
    for (int i = 0; i < places; ++i) {
      YarnJoint nearest{place_of(c, i), {0, 0, 0}, {0, 0}, curves[c].radius};
      float least = touching;
      for (std::size_t o = 0; o < plied.size(); ++o) {
        for (int k = 0; k < places * (2 * reach + 1) * (2 * reach + 1); ++k) {
          const V2i repeat(k % (2 * reach + 1) - reach, k / (2 * reach + 1) % (2 * reach + 1) - reach);
          // Yarn that continues touches its own.
          if (repeat == V2i(0, 0) || (o == c && repeat.x * turns.y == repeat.y * turns.x)) continue;
          const V3f other = place_of(o, k / ((2 * reach + 1) * (2 * reach + 1)));
          const V3f shift(static_cast<float>(repeat.x) * period.x, static_cast<float>(repeat.y) * period.y,
                          0);
          const float distance =
              (nearest.own_point - other - shift).length() / (curves[c].radius + curves[o].radius);
          if (distance >= least) continue;
          least = distance;
          nearest.other_point = other;
          nearest.neighbour_offset = repeat;
        }
      }
      if (least < touching) joints.push_back(nearest);
    }
  }
  return joints;
}

Imath::Box2d yarn_uv_bounds(const Yarns& yarns) {
  Imath::Box2d reach;
  for (const Yarns::Segment& s : yarns.geometry().segments) {
    if (s.hair_threshold > 0) continue;
    const V3f wide(section_extent(s.bounding_radius, s.squeeze, V3f(1, 0, 0)),
                   section_extent(s.bounding_radius, s.squeeze, V3f(0, 1, 0)), 0);
    for (const V3f& p : {s.start - wide, s.start + wide, s.start + s.along - wide, s.start + s.along + wide})
      reach.extendBy(V2d(p.x / yarns.period().x, -p.y / yarns.period().y));
  }
  return reach;
}

}  // namespace selvedge
