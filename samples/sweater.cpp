#include "samples/sweater.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "samples/band.h"
#include "samples/drape.h"
#include "samples/panels.h"
#include "samples/subdivide.h"
#include "samples/sweater_cage.h"

namespace selvedge::samples {
namespace {

bool is_band(int label) { return label >= panel_hem; }

/// Under the arm, where a sleeve is sewn together.
bool is_under_arm(const V3d& p, int side) { return (p - sleeve_centre(0, side)).dot(sleeve_up(side)) < 0; }

struct PanelPlan {
  std::set<int> labels;
  int side;  ///< 0: front or back
  double middle_u;
};

/// The charts lie side by side, so that no two of them overlap.
std::vector<PanelPlan> panel_plans() {
  return {{{panel_front}, 0, 0.0},
          {{panel_back}, 0, 0.7},
          {{panel_sleeve_right_front, panel_sleeve_right_back}, 1, 1.4},
          {{panel_sleeve_left_front, panel_sleeve_left_back}, -1, 2.0}};
}

/// The slack that makes the cloth fall into folds: it is longer than the way from hem to collar and from
/// shoulder to cuff, and nobody hangs straight.
V3d slack(const V3d& p) {
  const int side = p.x < 0 ? -1 : 1;
  const double along = (p - sleeve_centre(0, side)).dot(sleeve_direction(side));
  const double on_sleeve = std::clamp((std::abs(p.x) - 0.20) / 0.05, 0.0, 1.0);
  const double on_body = 1 - on_sleeve;
  V3d moved = p;
  moved.y += on_body * 0.026 * std::clamp(1 - p.y / 0.40, 0.0, 1.0);
  moved -= sleeve_direction(side) * (on_sleeve * 0.030 * std::clamp(along / 0.5, 0.0, 1.2));
  const double wave = 0.004 * std::sin(31 * p.x + 17 * p.y + 1.3) * std::sin(23 * p.z - 29 * p.y + 0.4) +
                      0.003 * std::sin(47 * p.y - 13 * p.x + 19 * p.z);
  // The hem does not lie quite level, nor quite round.
  const double around = std::atan2(p.x, p.z);
  const double low = on_body * std::clamp(1 - p.y / 0.25, 0.0, 1.0);
  moved.y += 0.004 * low * std::sin(2 * around + 0.7) + 0.002 * low * std::sin(5 * around);
  moved.x *= 1 + 0.012 * low * std::sin(3 * around + 0.4);
  moved.z *= 1 + 0.020 * low * std::sin(4 * around + 1.1);
  const V3d out(p.x, 0, p.z);
  return moved + out.normalized() * wave;
}

/// Takes the corners out of the neckline: around the ring, each point goes towards its neighbours' mean. The
/// cage's vertices there have five neighbours, where Catmull-Clark surfaces are less smooth.
void round_off(QuadSurface& surface, int label) {
  constexpr int rounds = 12;
  for (const std::vector<int>& ring : peel(surface, label, V3d(0, 0, 1))) {
    for (int round = 0; round < rounds; ++round) {
      std::vector<V3d> before;
      for (const int v : ring) before.push_back(surface.positions[v]);
      for (std::size_t j = 0; j < ring.size(); ++j) {
        const V3d& last = before[(j + ring.size() - 1) % ring.size()];
        const V3d& next = before[(j + 1) % ring.size()];
        surface.positions[ring[j]] = (last + before[j] * 2 + next) / 4;
      }
    }
  }
}

/// Threads along the quads' edges and diagonals, with the lengths of the flat pattern, and weak ones over two
/// quads, which resist bending.
std::vector<Thread> threads_of(const std::vector<Chart>& charts) {
  constexpr double shear = 2e-6;
  constexpr double bending = 1.5e-5;
  std::map<std::pair<int, int>, std::pair<double, int>> edges;
  std::vector<Thread> threads;
  std::map<int, std::set<std::pair<int, int>>> corners;  // point -> edges' far ends that share a quad
  for (const Chart& chart : charts) {
    const auto length = [&](int a, int b) { return (chart.plane[a] - chart.plane[b]).length(); };
    const auto point = [&](int v) { return chart.points[v]; };
    for (const Quad& quad : chart.quads) {
      for (std::size_t k = 0; k < 4; ++k) {
        const int a = quad[k];
        const int b = quad[(k + 1) % 4];
        auto& [sum, count] = edges[std::minmax(point(a), point(b))];
        sum += length(a, b);
        ++count;
        corners[point(a)].insert(std::minmax(point(b), point(quad[(k + 3) % 4])));
      }
      threads.push_back({point(quad[0]), point(quad[2]), length(quad[0], quad[2]), shear});
      threads.push_back({point(quad[1]), point(quad[3]), length(quad[1], quad[3]), shear});
    }
  }
  std::map<int, std::vector<std::pair<int, double>>> neighbours;
  for (const auto& [edge, sum] : edges) {
    const double length = sum.first / sum.second;
    threads.push_back({edge.first, edge.second, length, 0});
    neighbours[edge.first].emplace_back(edge.second, length);
    neighbours[edge.second].emplace_back(edge.first, length);
  }
  for (const auto& [point, around] : neighbours) {
    if (around.size() != 4) continue;
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = i + 1; j < 4; ++j) {
        if (corners[point].contains(std::minmax(around[i].first, around[j].first))) continue;
        threads.push_back({around[i].first, around[j].first, around[i].second + around[j].second, bending});
      }
    }
  }
  return threads;
}

void add_bands(Assembly& sweater, const QuadSurface& surface) {
  struct BandPlan {
    int label;
    V3d first;
    BandOptions options;
  };
  const std::array plans{
      BandPlan{panel_hem, V3d(-1, 0, 0), {.turned_back = 0.10, .row = 0.014}},
      BandPlan{panel_collar, V3d(0, 0, -1), {.roll = 0.0020, .turned_back = 0.75, .row = 0.009}},
      BandPlan{panel_cuff_right,
               V3d(-1, -1, 0),
               {.roll = 0.0018, .turned_back = 0.15, .row = 0.012, .middle_u = 1.4}},
      BandPlan{panel_cuff_left,
               V3d(1, -1, 0),
               {.roll = 0.0018, .turned_back = 0.15, .row = 0.012, .middle_u = 2.0}},
  };
  for (const BandPlan& plan : plans) {
    add_band(sweater, peel(surface, plan.label, plan.first), "trim", plan.options);
  }
}

/// Drops the points that no patch uses and puts the garment on y = 0.
void tidy(Assembly& sweater) {
  std::vector<int> renamed(sweater.points.size(), -1);
  std::vector<V3d> points;
  double low = sweater.points.front().y;
  for (Patch& patch : sweater.patches) {
    for (int& point : patch.points) {
      int& name = renamed[point];
      if (name < 0) {
        name = static_cast<int>(points.size());
        points.push_back(sweater.points[point]);
        low = std::min(low, points.back().y);
      }
      point = name;
    }
  }
  for (V3d& p : points) p.y -= low;
  sweater.points = std::move(points);
}

}  // namespace

Assembly make_sweater(const SweaterOptions& options) {
  QuadSurface surface = subdivide(sweater_cage(), options.levels);
  round_off(surface, panel_collar);

  const std::vector<PanelPlan> plans = panel_plans();
  std::vector<Chart> charts;
  for (const PanelPlan& plan : plans) {
    const auto cut = [&](int v) { return plan.side != 0 && is_under_arm(surface.positions[v], plan.side); };
    Chart& chart = charts.emplace_back(cut_out(surface, plan.labels, *plan.labels.rbegin(), cut));
    chart.plane = flatten(chart.panel);
  }

  Cloth cloth;
  cloth.threads = threads_of(charts);
  cloth.held.assign(surface.positions.size(), false);
  for (std::size_t q = 0; q < surface.quads.size(); ++q) {
    if (!is_band(surface.labels[q])) continue;
    for (const int v : surface.quads[q]) cloth.held[v] = true;
  }
  for (const V3d& p : surface.positions) cloth.positions.push_back(slack(p));
  DrapeOptions drape_options;
  drape_options.steps = options.drape_steps;
  cloth.positions = drape(cloth, body_distance, drape_options);
  surface.positions = smooth(cloth, 4, 0.2);

  Assembly sweater;
  sweater.points = surface.positions;
  for (std::size_t i = 0; i < plans.size(); ++i) {
    Chart& chart = charts[i];
    move_to(chart, surface.positions);
    chart.plane = relax(chart.panel, chart.plane);
    turn_to_grain(chart, plans[i].side == 0 ? V3d(0, -1, 0) : sleeve_direction(plans[i].side),
                  plans[i].middle_u);
    sweater.patches.push_back(patch_of(chart, "sweater"));
  }
  add_bands(sweater, surface);
  tidy(sweater);
  return sweater;
}

}  // namespace selvedge::samples
