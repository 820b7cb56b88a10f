#include "converter/mesh/trace_axes.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <numbers>
#include <numeric>

namespace selvedge {
namespace {

// Lengths in radii.
constexpr double step_length = 0.25;
constexpr double reach_of_step = 0.6;      ///< of the balls that a step looks at
constexpr double thickness_of_step = 0.3;  ///< of those that move its place
constexpr double used_reach = 0.5;         ///< around an axis: balls that begin no other
constexpr double seed_reach = 0.3;
constexpr double closing_distance = 0.3;

constexpr double radius_tolerance = 0.2;  ///< share by which the balls of one tube may differ
constexpr double min_share = 0.2;         ///< of the balls that a whole tube has
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
        grid_(centres_of(balls), period, cell),
        used_(balls.size(), false) {}

  std::vector<TubeAxis> trace() {
    std::vector<double> score(balls_.size());
    for (std::size_t i = 0; i < balls_.size(); ++i) {
      const double r = balls_[i].radius;
      score[i] = count_near(balls_[i].centre, seed_reach * r, r) / expected(r, seed_reach);
    }
    std::vector<int> seeds(balls_.size());
    std::iota(seeds.begin(), seeds.end(), 0);
    std::stable_sort(seeds.begin(), seeds.end(), [&](int a, int b) { return score[a] > score[b]; });
    std::vector<TubeAxis> axes;
    int failures = 0;
    for (const int seed : seeds) {
      if (score[seed] < min_share || failures > max_failures) break;
      if (used_[seed]) continue;
      TubeAxis axis;
      if (walk(balls_[seed], axis)) {
        axes.push_back(std::move(axis));
      } else {
        ++failures;
      }
      used_[seed] = true;
    }
    return axes;
  }

 private:
  static std::vector<V3d> centres_of(const std::vector<InnerBall>& balls) {
    std::vector<V3d> centres;
    centres.reserve(balls.size());
    for (const InnerBall& ball : balls) centres.push_back(ball.centre);
    return centres;
  }

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

  int count_near(const V3d& place, double reach, double radius) const {
    int count = 0;
    visit_tube(place, reach, radius, [&](int, const V3d&) { ++count; });
    return count;
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
    const double enough = std::max(3.0, min_share * expected(r, reach_of_step));
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

}  // namespace

V3d TubeAxis::node(int i, const V2d& period) const {
  const int count = static_cast<int>(nodes.size());
  const int repeat = i >= 0 ? i / count : -((count - 1 - i) / count);
  return nodes[i - repeat * count] + V3d(repeat * turns.x * period.x, repeat * turns.y * period.y, 0);
}

std::vector<TubeAxis> trace_axes(const std::vector<InnerBall>& balls, const V2d& period,
                                 double points_per_area, double area) {
  std::vector<double> radii;
  for (const InnerBall& ball : balls) radii.push_back(ball.radius);
  if (radii.empty()) return {};
  std::nth_element(radii.begin(), radii.begin() + radii.size() / 5, radii.end());
  return Tracer(balls, period, points_per_area, area, 0.4 * radii[radii.size() / 5]).trace();
}

}  // namespace selvedge
