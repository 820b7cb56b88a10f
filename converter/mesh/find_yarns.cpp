#include "converter/mesh/find_yarns.h"

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "converter/mesh/surface_points.h"
#include "converter/mesh/yarn_chain.h"
#include "format/base/parallel.h"

namespace selvedge {
namespace {

/// The axis of a tube: a closed polyline; from the last node it runs on to the first of the repeat that lies
/// `turns` away.
struct TubeAxis {
  V2i turns{0, 0};  ///< in periods
  double radius = 0;
  std::vector<V3d> nodes;  ///< mm, about a quarter of a radius apart

  /// The node `i` places after the first, also beyond both ends.
  V3d node(int i, const V2d& period) const {
    const int count = static_cast<int>(nodes.size());
    const int repeat = i >= 0 ? i / count : -((count - 1 - i) / count);
    return nodes[i - repeat * count] + V3d(repeat * turns.x * period.x, repeat * turns.y * period.y, 0);
  }
};

/// The largest ball that touches the surface in a point from inside.
struct InnerBall {
  V3d centre{0, 0, 0};  ///< mm, x and y within the cell
  double radius = 0;
};

template <class Item>
std::vector<V3d> places_of(const std::vector<Item>& items, V3d Item::*place) {
  std::vector<V3d> places;
  for (const Item& item : items) places.push_back(item.*place);
  return places;
}

// Lengths in radii.
constexpr double step_length = 0.25;
constexpr double reach_of_step = 0.6;      ///< of the balls that a step looks at
constexpr double thickness_of_step = 0.3;  ///< of those that move its place
constexpr double used_reach = 0.5;         ///< around an axis: balls that begin no other
constexpr double seed_reach = 0.3;
constexpr double closing_distance = 0.3;

constexpr double radius_tolerance = 0.2;  ///< fraction by which the balls of one tube may differ
constexpr double min_fraction = 0.2;      ///< of the balls that a whole tube has
constexpr int max_gap = 4;                ///< steps without enough balls
constexpr int max_failures = 1000;        ///< walks that did not close

/// The balls around a place of an axis.
struct Neighbourhood {
  int count = 0;
  V3d centre{0, 0, 0};  ///< of those near the plane across the axis
  V3d along{0, 0, 0};   ///< unit, either sign
  double slimness = 0;  ///< of their spread: 0 a ball or sheet, 1 a line
};

class Tracer {
 public:
  Tracer(const std::vector<InnerBall>& balls, const V2d& period, double points_per_area, double area,
         double cell)
      : balls_(balls),
        period_(period),
        points_per_area_(points_per_area),
        area_(area),
        grid_(places_of(balls, &InnerBall::centre), period, cell),
        used_(balls.size(), false) {}

  std::vector<TubeAxis> trace() {
    std::vector<double> score(balls_.size());
    for (std::size_t i = 0; i < balls_.size(); ++i) {
      const double r = balls_[i].radius;
      int near = 0;
      visit_tube(balls_[i].centre, seed_reach * r, r, [&](int, const V3d&) { ++near; });
      score[i] = near / expected(r, seed_reach);
    }
    std::vector<int> seeds(balls_.size());
    std::iota(seeds.begin(), seeds.end(), 0);
    std::ranges::stable_sort(seeds, [&](int a, int b) { return score[a] > score[b]; });
    std::vector<TubeAxis> axes;
    int failures = 0;
    for (const int seed : seeds) {
      if (score[seed] < min_fraction || failures > max_failures) break;
      if (used_[seed]) continue;
      TubeAxis axis;
      if (walk(balls_[seed], axis))
        axes.push_back(std::move(axis));
      else
        ++failures;
      used_[seed] = true;
    }
    return axes;
  }

 private:
  /// Balls of a whole tube within `reach` radii of a place on its axis.
  double expected(double radius, double reach) const {
    return 2 * std::numbers::pi * radius * 2 * reach * radius * points_per_area_;
  }

  template <class Visit>
  void visit_tube(const V3d& place, double reach, double radius, const Visit& visit) const {
    double all = reach;
    grid_.visit_near(place, all, [&](int i, const V3d& offset) {
      if (offset.length2() > reach * reach || used_[i]) return;
      if (std::abs(balls_[i].radius - radius) <= radius_tolerance * radius) visit(i, offset);
    });
  }

  /// With `axis` the centre moves only across it.
  Neighbourhood look(const V3d& place, double radius, const V3d& axis) const {
    Neighbourhood found;
    V3d sum(0, 0, 0);
    double weight = 0;
    V3d mean(0, 0, 0);
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    visit_tube(place, reach_of_step * radius, radius, [&](int, const V3d& offset) {
      ++found.count;
      mean += offset;
      const Eigen::Vector3d o(offset.x, offset.y, offset.z);
      moments += o * o.transpose();
      if (std::abs(offset.dot(axis)) > thickness_of_step * radius) return;
      const V3d across = offset - axis * offset.dot(axis);
      const double w = std::exp(-8 * across.length2() / (radius * radius));
      sum += across * w;
      weight += w;
    });
    if (found.count < 3) return found;
    found.centre = place + (weight > 0 ? sum / weight : V3d(0, 0, 0));
    mean /= found.count;
    const Eigen::Vector3d m(mean.x, mean.y, mean.z);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moments / found.count - m * m.transpose());
    const Eigen::Vector3d along = solver.eigenvectors().col(2);
    found.along = V3d(along.x(), along.y(), along.z());
    found.slimness = 1 - std::max(0.0, solver.eigenvalues()(1)) / std::max(1e-300, solver.eigenvalues()(2));
    return found;
  }

  void use(const V3d& place, double reach) {
    double all = reach;
    grid_.visit_near(place, all, [&](int i, const V3d& offset) {
      if (offset.length2() <= reach * reach) used_[i] = true;
    });
  }

  /// Walks from a ball until the axis comes back to it; the balls along the way are used then, in any case.
  bool walk(const InnerBall& seed, TubeAxis& axis) {
    std::vector<double> radii;
    visit_tube(seed.centre, used_reach * seed.radius, seed.radius,
               [&](int i, const V3d&) { radii.push_back(balls_[i].radius); });
    std::nth_element(radii.begin(), radii.begin() + radii.size() / 2, radii.end());
    const double r = radii[radii.size() / 2];
    axis.radius = r;
    const double enough = std::max(3.0, min_fraction * expected(r, reach_of_step));
    const auto is_tube = [&](const Neighbourhood& n) { return n.count >= enough && n.slimness > 0.5; };
    Neighbourhood here = look(seed.centre, r, V3d(0, 0, 0));
    const V3d start = here.centre;
    const V3d start_along = here.along;
    V3d along = start_along;
    bool closed = false;
    if (is_tube(here)) {
      axis.nodes.push_back(start);
      // A tube is no longer than its surface allows, of which half may be hidden.
      const int max_steps = static_cast<int>(8 + 2 * area_ / (2 * std::numbers::pi * r) / (step_length * r));
      for (int step = 0, gap = 0; step < max_steps && gap <= max_gap && !closed; ++step) {
        const V3d ahead = axis.nodes.back() + along * (step_length * r);
        here = look(ahead, r, along);
        if (is_tube(here)) {
          gap = 0;
          along = here.along.dot(along) < 0 ? -here.along : here.along;
          axis.nodes.push_back(here.centre);
        } else {
          ++gap;
          axis.nodes.push_back(ahead);
        }
        const V3d way = axis.nodes.back() - start;
        axis.turns = V2i(static_cast<int>(std::lround(way.x / period_.x)),
                         static_cast<int>(std::lround(way.y / period_.y)));
        const V3d rest = way - V3d(axis.turns.x * period_.x, axis.turns.y * period_.y, 0);
        closed = step >= 3 && rest.length() < closing_distance * r && along.dot(start_along) > 0.5;
        if (closed && rest.dot(start_along) > -0.1 * r) axis.nodes.pop_back();
      }
    }
    use(start, used_reach * r);
    for (const V3d& node : axis.nodes) use(node, used_reach * r);
    return closed;
  }

  const std::vector<InnerBall>& balls_;
  V2d period_;
  double points_per_area_;
  double area_;
  PeriodicGrid grid_;
  std::vector<bool> used_;
};

constexpr double tolerance = 0.1;         ///< radii
constexpr float albedo_tolerance = 0.1F;  ///< of a colour channel
constexpr double min_support = 0.4;       ///< fraction of a tube's area that the mesh must show

constexpr int min_points = 4096;
constexpr int max_points = 1 << 18;
constexpr double points_per_radius = 6;

/// A surface sampled densely enough for its thinnest tubes, and the balls inside it.
struct Sampled {
  std::vector<SampledPoint> points;
  double per_area = 0;  ///< mm^-2
  double area = 0;      ///< mm^2
  std::vector<InnerBall> balls;
};

/// Radii of the balls at every `stride`-th point, the others 0.
std::vector<double> inner_radii(const std::vector<SampledPoint>& points, const V2d& period, double spacing,
                                double max_radius, int stride) {
  const PeriodicGrid grid(places_of(points, &SampledPoint::position), period, 2.5 * spacing);
  std::vector<double> radii((points.size() + stride - 1) / stride);
  parallel_for(0, static_cast<int>(radii.size()),
               [&](int i) { radii[i] = inner_radius(points, grid, i * stride, max_radius).value_or(0); });
  return radii;
}

Sampled sample(const CellMesh& mesh) {
  Sampled s;
  s.area = surface_area(mesh);
  const Imath::Box3f box = bounds_of(mesh);
  double max_radius =
      std::min<double>(0.51 * (box.max.z - box.min.z), 2 * std::min(mesh.period.x, mesh.period.y));
  if (!(max_radius > 0)) return s;
  int count = min_points;
  for (;; count *= 4) {
    s.points = sample_surface(mesh, count);
    const double spacing = std::sqrt(s.area / count);
    const int stride = std::max<int>(1, static_cast<int>(s.points.size() / 512));
    // Thicker tubes would have shown in fewer points; looking for them here would take long.
    const double limit = std::min(max_radius, 32 * spacing);
    std::vector<double> radii = inner_radii(s.points, mesh.period, spacing, limit, stride);
    const std::size_t tried = radii.size();
    std::erase(radii, 0.0);
    std::ranges::sort(radii);
    const bool last = count >= max_points;
    if (radii.size() < std::max<std::size_t>(16, tried / 4)) {
      if (last) return s;
      continue;
    }
    const double thin = radii[radii.size() / 5];
    const double thick = radii[radii.size() * 19 / 20];
    if (!last && spacing >= 1.5 * thin) continue;
    const double finer = std::max(thin / points_per_radius, thick / 16);
    max_radius = std::min(max_radius, 1.3 * thick);
    count = static_cast<int>(std::clamp<double>(s.area / (finer * finer), min_points, max_points));
    break;
  }
  s.points = sample_surface(mesh, count);
  s.per_area = count / s.area;
  const std::vector<double> radii =
      inner_radii(s.points, mesh.period, std::sqrt(s.area / count), max_radius, 1);
  for (std::size_t i = 0; i < radii.size(); ++i) {
    if (radii[i] == 0) continue;
    V3d centre = s.points[i].position - s.points[i].normal * radii[i];
    for (int k = 0; k < 2; ++k) centre[k] = wrap_to_repeat(centre[k], mesh.period[k]);
    s.balls.push_back({centre, radii[i]});
  }
  return s;
}

/// Smooths without shrinking (Taubin 1995, lambda and mu).
void smooth(TubeAxis& axis, const V2d& period) {
  for (int pass = 0; pass < 10; ++pass) {
    const double factor = pass % 2 == 0 ? 0.5 : -0.53;
    std::vector<V3d> moved = axis.nodes;
    for (int i = 0; i < static_cast<int>(moved.size()); ++i) {
      const V3d mean = (axis.node(i - 1, period) + axis.node(i + 1, period)) * 0.5;
      moved[i] += (mean - axis.nodes[i]) * factor;
    }
    axis.nodes = std::move(moved);
  }
}

/// Cubic curve through the nodes (Catmull-Rom), `fraction` of the way from node i to the next.
V3d curve_point(const TubeAxis& axis, int i, double fraction, const V2d& period) {
  const V3d a = axis.node(i - 1, period);
  const V3d b = axis.node(i, period);
  const V3d c = axis.node(i + 1, period);
  const V3d d = axis.node(i + 2, period);
  const double t = fraction;
  return b + ((c - a) + ((a * 2.0 - b * 5.0 + c * 4.0 - d) + ((b - c) * 3.0 + d - a) * t) * t) * (0.5 * t);
}

/// Twice as many nodes: half the sag.
void refine(TubeAxis& axis, const V2d& period) {
  std::vector<V3d> finer;
  for (int i = 0; i < static_cast<int>(axis.nodes.size()); ++i) {
    finer.push_back(axis.nodes[i]);
    finer.push_back(curve_point(axis, i, 0.5, period));
  }
  axis.nodes = std::move(finer);
}

/// Where a point of the surface lies about the nearest axis.
struct Foot {
  int axis = -1;
  int node = 0;         ///< at the start of the nearest segment
  double fraction = 0;  ///< along it
  double distance = 0;
  V3d outward{0, 0, 0};  ///< unit
};

std::vector<Foot> feet_of(const std::vector<SampledPoint>& points, const std::vector<TubeAxis>& axes,
                          const V2d& period) {
  std::vector<Foot> feet(points.size());
  std::vector<V3d> nodes;
  std::vector<std::pair<int, int>> owner;
  double thick = 0;
  double thin = std::numeric_limits<double>::max();
  for (std::size_t a = 0; a < axes.size(); ++a) {
    thick = std::max(thick, axes[a].radius);
    thin = std::min(thin, axes[a].radius);
    for (std::size_t n = 0; n < axes[a].nodes.size(); ++n) {
      V3d node = axes[a].nodes[n];
      for (int k = 0; k < 2; ++k) node[k] = wrap_to_repeat(node[k], period[k]);
      nodes.push_back(node);
      owner.emplace_back(static_cast<int>(a), static_cast<int>(n));
    }
  }
  if (axes.empty()) return feet;
  const PeriodicGrid grid(std::move(nodes), period, 0.5 * thin);
  parallel_for(0, static_cast<int>(points.size()), [&](int p) {
    const V3d place = points[p].position;
    double reach = 1.5 * thick;
    int nearest = -1;
    V3d offset;
    double best = std::numeric_limits<double>::max();
    grid.visit_near(place, reach, [&](int i, const V3d& o) {
      const double above = o.length() - axes[owner[i].first].radius;
      if (above >= best) return;
      best = above;
      nearest = i;
      offset = o;
      reach = std::min(reach, std::max(0.0, above) + thick);
    });
    if (nearest < 0) return;
    const auto [a, n] = owner[nearest];
    const V3d to_place = axes[a].nodes[n] - offset;  // the point, in the chain's own place
    Foot& foot = feet[p];
    foot.axis = a;
    foot.distance = std::numeric_limits<double>::max();
    for (const int from : {n - 1, n}) {
      const V3d start = axes[a].node(from, period);
      const V3d chord = axes[a].node(from + 1, period) - start;
      const double t = std::clamp((to_place - start).dot(chord) / chord.length2(), 0.0, 1.0);
      const V3d out = to_place - start - chord * t;
      if (out.length() >= foot.distance) continue;
      const int count = static_cast<int>(axes[a].nodes.size());
      foot = {a, (from + count) % count, t, out.length(), out.normalized()};
    }
  });
  return feet;
}

bool supports(const SampledPoint& point, const Foot& foot, const std::vector<TubeAxis>& axes, double radii) {
  if (foot.axis < 0 || foot.outward.dot(point.normal) < 0.7) return false;
  const double radius = axes[foot.axis].radius;
  return std::abs(foot.distance - radius) <= radii * radius;
}

/// Moves the axes and their radii until the surface lies one radius away from them.
void fit_to_surface(const std::vector<SampledPoint>& points, const V2d& period, std::vector<TubeAxis>& axes) {
  constexpr int passes = 5;
  constexpr int half_window = 4;  // nodes
  for (int pass = 0; pass < passes; ++pass) {
    const std::vector<Foot> feet = feet_of(points, axes, period);
    std::vector<std::vector<double>> distances(axes.size());
    std::vector<std::vector<Eigen::Matrix3d>> matrix(axes.size());
    std::vector<std::vector<Eigen::Vector3d>> right(axes.size());
    for (std::size_t a = 0; a < axes.size(); ++a) {
      matrix[a].assign(axes[a].nodes.size(), Eigen::Matrix3d::Zero());
      right[a].assign(axes[a].nodes.size(), Eigen::Vector3d::Zero());
    }
    for (std::size_t p = 0; p < points.size(); ++p) {
      const Foot& foot = feet[p];
      if (!supports(points[p], foot, axes, 0.3)) continue;
      distances[foot.axis].push_back(foot.distance);
      const Eigen::Vector3d out(foot.outward.x, foot.outward.y, foot.outward.z);
      const double error = foot.distance - axes[foot.axis].radius;
      const int count = static_cast<int>(axes[foot.axis].nodes.size());
      for (int k = 0; k < 2; ++k) {
        const int node = (foot.node + k) % count;
        const double weight = k == 0 ? 1 - foot.fraction : foot.fraction;
        matrix[foot.axis][node] += weight * out * out.transpose();
        right[foot.axis][node] += weight * error * out;
      }
    }
    for (std::size_t a = 0; a < axes.size(); ++a) {
      TubeAxis& axis = axes[a];
      if (distances[a].empty()) continue;
      const int count = static_cast<int>(axis.nodes.size());
      std::vector<V3d> moved = axis.nodes;
      for (int i = 0; i < count; ++i) {
        Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
        Eigen::Vector3d b = Eigen::Vector3d::Zero();
        for (int k = -half_window; k <= half_window; ++k) {
          const int j = ((i + k) % count + count) % count;
          const double weight = half_window + 1 - std::abs(k);
          m += weight * matrix[a][j];
          b += weight * right[a][j];
        }
        if (m.trace() == 0) continue;
        m += 0.02 * m.trace() * Eigen::Matrix3d::Identity();
        Eigen::Vector3d move = m.ldlt().solve(b);
        move *= std::min(1.0, 0.2 * axis.radius / std::max(1e-300, move.norm()));
        moved[i] += V3d(move.x(), move.y(), move.z());
      }
      axis.nodes = std::move(moved);
      auto& d = distances[a];
      std::nth_element(d.begin(), d.begin() + d.size() / 2, d.end());
      axis.radius = d[d.size() / 2];
    }
  }
}

double length_of(const TubeAxis& axis, const V2d& period) {
  double length = 0;
  for (int i = 0; i < static_cast<int>(axis.nodes.size()); ++i)
    length += (axis.node(i + 1, period) - axis.nodes[i]).length();
  return length;
}

/// Albedo of the curves, as the mean over the points that support them, and the fraction of all points that
/// these represent.
double describe(const std::vector<SampledPoint>& points, const V2d& period, const std::vector<TubeAxis>& axes,
                std::vector<YarnCurve>& curves) {
  const std::vector<Foot> feet = feet_of(points, axes, period);
  std::vector<V3d> sums(axes.size(), V3d(0, 0, 0));
  std::vector<int> counts(axes.size());
  for (std::size_t p = 0; p < points.size(); ++p) {
    if (!supports(points[p], feet[p], axes, tolerance)) continue;
    sums[feet[p].axis] += V3d(points[p].albedo);
    ++counts[feet[p].axis];
  }
  curves.resize(axes.size());
  for (std::size_t a = 0; a < axes.size(); ++a) {
    curves[a].repeat_offset = axes[a].turns;
    curves[a].radius = static_cast<float>(axes[a].radius);
    curves[a].albedo = V3f(sums[a] / std::max(1, counts[a]));
  }
  int represented = 0;
  for (std::size_t p = 0; p < points.size(); ++p) {
    if (!supports(points[p], feet[p], axes, tolerance)) continue;
    const V3f difference = points[p].albedo - curves[feet[p].axis].albedo;
    represented += std::max({std::abs(difference.x), std::abs(difference.y), std::abs(difference.z)}) <=
                   albedo_tolerance;
  }
  return static_cast<double>(represented) / static_cast<double>(points.size());
}

/// Points of the axis close enough for append_chain(), the first within the cell.
std::vector<ChainPoint> dense_points(const TubeAxis& axis, const V2d& period) {
  constexpr int per_node = 4;
  const V3d first = axis.nodes.front();
  const V3d shift(std::floor(first.x / period.x) * period.x, std::floor(first.y / period.y) * period.y, 0);
  std::vector<ChainPoint> points;
  const int count = static_cast<int>(axis.nodes.size());
  for (int i = 0; i < count * per_node; ++i)
    points.push_back({curve_point(axis, i / per_node, (i % per_node) / double{per_node}, period) - shift});
  points.push_back({axis.node(count, period) - shift});
  return points;
}

}  // namespace

FoundYarns find_yarns(const CellMesh& mesh) {
  FoundYarns found;
  const Sampled s = sample(mesh);
  if (s.balls.empty()) return found;
  std::vector<double> radii;
  for (const InnerBall& ball : s.balls) radii.push_back(ball.radius);
  std::nth_element(radii.begin(), radii.begin() + radii.size() / 5, radii.end());
  std::vector<TubeAxis> axes =
      Tracer(s.balls, mesh.period, s.per_area, s.area, 0.4 * radii[radii.size() / 5]).trace();
  for (TubeAxis& axis : axes) {
    smooth(axis, mesh.period);
    refine(axis, mesh.period);
  }
  fit_to_surface(s.points, mesh.period, axes);
  // Tubes that the mesh shows too little of are left out.
  const std::vector<Foot> feet = feet_of(s.points, axes, mesh.period);
  std::vector<int> support(axes.size());
  for (std::size_t p = 0; p < s.points.size(); ++p)
    if (supports(s.points[p], feet[p], axes, tolerance)) ++support[feet[p].axis];
  std::vector<TubeAxis> kept;
  for (std::size_t a = 0; a < axes.size(); ++a) {
    const double whole = 2 * std::numbers::pi * axes[a].radius * length_of(axes[a], mesh.period) * s.per_area;
    if (support[a] >= min_support * whole) kept.push_back(std::move(axes[a]));
  }
  if (kept.empty()) return found;
  std::vector<YarnCurve> curves;
  found.explained_fraction = describe(s.points, mesh.period, kept, curves);
  for (std::size_t a = 0; a < kept.size(); ++a)
    append_chain(curves[a], dense_points(kept[a], mesh.period), kept[a].radius, {}, found.yarns);
  return found;
}

}  // namespace selvedge
