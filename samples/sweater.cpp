#include "samples/sweater.h"

#include <Imath/ImathBox.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <set>
#include <vector>

#include "format/scene/flatten.h"
#include "samples/drape.h"
#include "samples/subdivide.h"
#include "samples/sweater_cage.h"

namespace selvedge::samples {
namespace {

/// A closed strip of a surface as rings of points: ring 0 is the seam, the last one the open edge. All rings
/// have the same number of points, one behind the other, counter-clockwise seen from outside when the edge is
/// below the seam, i.e. the quad of ring i, i + 1 and column j, j + 1 is (i, j), (i + 1, j), (i + 1, j + 1),
/// (i, j + 1).
using Rings = std::vector<std::vector<int>>;

struct BandOptions {
  double repeat = 0.016;     ///< width of a rib's repeat, metres: a whole number of them goes around
  double roll = 0.0024;      ///< radius of the turned edge
  double turned_back = 0.4;  ///< how much of the height is turned to the inside
  double column = 0.0025;    ///< width of a column, metres
  double row = 0.010;        ///< height of a row, metres
  double middle_u = 0;       ///< where the chart lies
};

/// A closed curve through points (Catmull-Rom), by its arc length.
class ClosedCurve {
 public:
  ClosedCurve(const std::vector<V3d>& points, const std::vector<int>& ring) : starts_{0} {
    for (const int p : ring) points_.push_back(points[p]);
    for (std::size_t j = 0; j < points_.size(); ++j) {
      starts_.push_back(starts_.back() + (points_[(j + 1) % points_.size()] - points_[j]).length());
    }
  }

  double length() const { return starts_.back(); }
  /// Where point j lies, in [0, 1].
  double around(std::size_t j) const { return starts_[j] / length(); }

  V3d at(double around) const {
    const std::size_t count = points_.size();
    const double s = (around - std::floor(around)) * length();
    const auto after = std::ranges::upper_bound(starts_, s);
    const std::size_t j = std::min(static_cast<std::size_t>(after - starts_.begin()) - 1, count - 1);
    const double t = (s - starts_[j]) / (starts_[j + 1] - starts_[j]);
    const V3d& a = points_[(j + count - 1) % count];
    const V3d& b = points_[j];
    const V3d& c = points_[(j + 1) % count];
    const V3d& d = points_[(j + 2) % count];
    return (b * 2 + (c - a) * t + (a * 2 - b * 5 + c * 4 - d) * (t * t) +
            (b * 3 - a - c * 3 + d) * (t * t * t)) *
           0.5;
  }

 private:
  std::vector<V3d> points_;
  std::vector<double> starts_;
};

/// A strip as a ruled surface from the seam, both of its edges by their own arc length, so that stitches keep
/// their width; leaning towards right angles with the seam, so that they keep their shape. `around` in [0,
/// 1), `down` in metres from the seam, the same height all around.
class Strip {
 public:
  Strip(const std::vector<V3d>& points, const Rings& rings) : seam_(points, rings.front()) {
    aim_at(ClosedCurve(points, rings.back()));
  }

  double height() const { return height_; }
  double around(std::size_t j) const { return seam_.around(j); }

  V3d at(double around, double down) const { return seam_.at(around) + direction(around) * down; }

  /// Outwards, by central differences over some millimetres.
  V3d normal(double around, double down) const {
    const double h = 0.004 / seam_.length();
    const V3d across = at(around + h, down) - at(around - h, down);
    return direction(around).cross(across).normalized();
  }

  /// The way around at a height, so far inside of the strip; metres.
  double length_at(double down, double inside) const {
    constexpr int steps = 256;
    double sum = 0;
    V3d last = at(0, down) - normal(0, down) * inside;
    for (int i = 1; i <= steps; ++i) {
      const double s = static_cast<double>(i) / steps;
      const V3d p = at(s, down) - normal(s, down) * inside;
      sum += (p - last).length();
      last = p;
    }
    return sum;
  }

 private:
  static constexpr int steps_around = 64;

  /// Directions, evenly spaced; smoothed, because a fan of directions stretches the stitches at the edge.
  void aim_at(const ClosedCurve& edge) {
    for (int i = 0; i < steps_around; ++i) {
      const double s = static_cast<double>(i) / steps_around;
      const V3d down = edge.at(s) - seam_.at(s);
      height_ += down.length() / steps_around;
      const V3d tangent = (seam_.at(s + 0.01) - seam_.at(s - 0.01)).normalized();
      directions_.push_back((down - tangent * tangent.dot(down)).normalized());
    }
    constexpr int smoothing = 48;
    for (int round = 0; round < smoothing; ++round) {
      const std::vector<V3d> rough = directions_;
      for (std::size_t i = 0; i < rough.size(); ++i) {
        const V3d& before = rough[(i + rough.size() - 1) % rough.size()];
        directions_[i] = (before + rough[i] * 2 + rough[(i + 1) % rough.size()]).normalized();
      }
    }
  }

  V3d direction(double around) const {
    const double s = (around - std::floor(around)) * steps_around;
    const std::size_t i = static_cast<std::size_t>(s) % steps_around;
    const double t = s - std::floor(s);
    return (directions_[i] * (1 - t) + directions_[(i + 1) % steps_around] * t).normalized();
  }

  ClosedCurve seam_;
  std::vector<V3d> directions_;  ///< unit, from the seam to the edge
  double height_ = 0;
};

/// One row of the band's cross-section: where it lies on the strip and how far inside of it.
struct Station {
  double down;    ///< metres from the seam along the strip
  double inside;  ///< metres
  double length;  ///< metres along the section from the seam: the texture's v
};

std::vector<Station> section_of(double height, const BandOptions& o) {
  std::vector<Station> stations;
  const double straight = height - o.roll;
  constexpr double first_row = 0.003;
  const int rows = std::max(1, static_cast<int>(std::lround((straight - first_row) / o.row)));
  for (int i = 0; i <= rows; ++i) {
    const double down = first_row + (straight - first_row) * i / rows;
    stations.push_back({down, 0, down});
  }
  constexpr int bends = 4;
  for (int i = 1; i <= bends; ++i) {
    const double angle = std::numbers::pi * i / bends;
    stations.push_back(
        {straight + o.roll * std::sin(angle), o.roll * (1 - std::cos(angle)), straight + o.roll * angle});
  }
  const double back = o.turned_back * straight;
  const int back_rows = std::max(1, static_cast<int>(std::lround(back / o.row)));
  const double bent = stations.back().length;
  for (int i = 1; i <= back_rows; ++i) {
    const double up = back * i / back_rows;
    stations.push_back({straight - up, 2 * o.roll, bent + up});
  }
  return stations;
}

/// Two rings of different numbers of points, joined by triangles; both carry one point more than they have
/// columns, the last one on the first.
void join(Patch& patch, int upper_first, const std::vector<double>& upper, int lower_first,
          const std::vector<double>& lower) {
  std::size_t i = 0;
  std::size_t j = 0;
  while (i + 1 < upper.size() || j + 1 < lower.size()) {
    const int a = upper_first + static_cast<int>(i);
    const int b = lower_first + static_cast<int>(j);
    const bool step_lower = i + 1 == upper.size() || (j + 1 < lower.size() && lower[j + 1] <= upper[i + 1]);
    if (step_lower) {
      patch.triangles.emplace_back(a, b, b + 1);
      ++j;
    } else {
      patch.triangles.emplace_back(a, b, a + 1);
      ++i;
    }
  }
}

/// The quads with the label, peeled from the open boundary inwards. `first` picks the column that comes
/// first, by the largest value over the seam's points. Precondition: they are a closed strip, and a grid.
Rings peel(const QuadSurface& surface, int label, const V3d& first) {
  std::map<std::pair<int, int>, int> quad_of;  // directed edge -> quad of the strip
  std::map<std::pair<int, int>, int> any_quad_of;
  for (std::size_t q = 0; q < surface.quads.size(); ++q) {
    for (std::size_t k = 0; k < 4; ++k) {
      const std::pair edge(surface.quads[q][k], surface.quads[q][(k + 1) % 4]);
      any_quad_of[edge] = static_cast<int>(q);
      if (surface.labels[q] == label) quad_of[edge] = static_cast<int>(q);
    }
  }
  std::map<int, int> next;
  for (const auto& [edge, quad] : quad_of) {
    if (!any_quad_of.contains({edge.second, edge.first})) next[edge.first] = edge.second;
  }
  Rings rings{{next.begin()->first}};
  for (int p = next.begin()->second; p != rings[0].front(); p = next.at(p)) rings[0].push_back(p);
  for (;;) {
    const std::vector<int>& ring = rings.back();
    std::vector<int> inner;
    for (std::size_t j = 0; j < ring.size(); ++j) {
      const auto found = quad_of.find({ring[j], ring[(j + 1) % ring.size()]});
      if (found == quad_of.end()) break;
      const Quad& quad = surface.quads[found->second];
      const std::size_t k = static_cast<std::size_t>(std::ranges::find(quad, ring[j]) - quad.begin());
      inner.push_back(quad[(k + 3) % 4]);
    }
    if (inner.empty()) break;
    rings.push_back(inner);
  }

  std::ranges::reverse(rings);
  const std::vector<int>& seam = rings.front();
  const auto start = std::ranges::max_element(
      seam, [&](int a, int b) { return first.dot(surface.positions[a]) < first.dot(surface.positions[b]); });
  const auto shift = start - seam.begin();
  for (std::vector<int>& ring : rings) std::rotate(ring.begin(), ring.begin() + shift, ring.end());
  return rings;
}

/// Replaces a strip of `surface` by a band with a turned edge, knit in one with the points of the
/// seam. New points are added to the assembly, which begins with the points of the surface.
void add_band(Assembly& assembly, const Rings& rings, const std::string& material,
              const BandOptions& options) {
  const Strip strip(assembly.points, rings);
  const std::vector<Station> section = section_of(strip.height(), options);
  // The mean way around, weighted by the height of the rows; the inner side's is shorter.
  double around_mean = 0;
  for (std::size_t i = 0; i < section.size(); ++i) {
    const double above = i == 0 ? 0 : section[i - 1].length;
    around_mean += (section[i].length - above) * strip.length_at(section[i].down, section[i].inside);
  }
  around_mean /= section.back().length;
  const int columns = static_cast<int>(std::lround(around_mean / options.column));
  const double width = std::round(around_mean / options.repeat) * options.repeat;

  Patch patch;
  patch.material = material;
  const auto add_vertex = [&](int point, double around, double length) {
    patch.points.push_back(point);
    patch.tex_coords.emplace_back(options.middle_u + (around - 0.5) * width, length);
  };

  std::vector<double> upper;
  const std::vector<int>& seam = rings.front();
  for (std::size_t j = 0; j <= seam.size(); ++j) {
    upper.push_back(strip.around(j));
    add_vertex(seam[j % seam.size()], upper.back(), 0);
  }
  std::vector<double> lower;
  for (int j = 0; j <= columns; ++j) lower.push_back(static_cast<double>(j) / columns);

  int above = 0;
  bool first = true;
  for (const Station& station : section) {
    const int here = static_cast<int>(patch.points.size());
    const int first_point = static_cast<int>(assembly.points.size());
    for (int j = 0; j < columns; ++j) {
      const double around = lower[j];
      assembly.points.push_back(strip.at(around, station.down) -
                                strip.normal(around, station.down) * station.inside);
    }
    for (int j = 0; j <= columns; ++j) add_vertex(first_point + j % columns, lower[j], station.length);
    if (first) {
      join(patch, above, upper, here, lower);
    } else {
      for (int j = 0; j < columns; ++j) {
        patch.triangles.emplace_back(above + j, here + j, here + j + 1);
        patch.triangles.emplace_back(above + j, here + j + 1, above + j + 1);
      }
    }
    above = here;
    first = false;
  }
  assembly.patches.push_back(std::move(patch));
}

/// A panel cut out of a surface.
struct Chart {
  Panel panel;
  std::vector<int> points;                ///< per vertex of the panel, the vertex of the surface
  std::vector<std::array<int, 4>> quads;  ///< vertices of the panel
  std::vector<V2d> plane;                 ///< per vertex, metres; u to the right, v up, until `turn_to_grain`
};

/// Cuts out the quads with one of `labels`. Vertices for which `cut` is true get a second vertex for the
/// quads labelled `beyond`, so that a tube becomes a disc. Quads become two triangles each, over the shorter
/// diagonal. `plane` stays empty.
Chart cut_out(const QuadSurface& surface, const std::set<int>& labels, int beyond,
              const std::function<bool(int)>& cut) {
  Chart chart;
  std::map<std::pair<int, bool>, int> vertices;
  for (std::size_t q = 0; q < surface.quads.size(); ++q) {
    if (!labels.contains(surface.labels[q])) continue;
    std::array<int, 4> quad{};
    for (std::size_t k = 0; k < 4; ++k) {
      const int point = surface.quads[q][k];
      const bool second = surface.labels[q] == beyond && cut(point);
      const auto [entry, added] =
          vertices.try_emplace({point, second}, static_cast<int>(chart.points.size()));
      if (added) {
        chart.points.push_back(point);
        chart.panel.positions.push_back(surface.positions[point]);
      }
      quad[k] = entry->second;
    }
    chart.quads.push_back(quad);
    const auto corner = [&](std::size_t k) { return chart.panel.positions[quad[k]]; };
    if ((corner(0) - corner(2)).length2() <= (corner(1) - corner(3)).length2()) {
      chart.panel.triangles.emplace_back(quad[0], quad[1], quad[2]);
      chart.panel.triangles.emplace_back(quad[0], quad[2], quad[3]);
    } else {
      chart.panel.triangles.emplace_back(quad[0], quad[1], quad[3]);
      chart.panel.triangles.emplace_back(quad[1], quad[2], quad[3]);
    }
  }
  return chart;
}

/// Puts the positions of the surface into the panel once more (after draping).
void move_to(Chart& chart, const std::vector<V3d>& positions) {
  for (std::size_t v = 0; v < chart.points.size(); ++v) {
    chart.panel.positions[v] = positions[chart.points[v]];
  }
}

/// Turns the plane such that the wales follow `down` (metres, garment's frame) in the mean over the area,
/// moves its middle to u = `middle_u` and its upper end to v = 0, and lets v grow downwards (glTF).
void turn_to_grain(Chart& chart, const V3d& down, double middle_u) {
  const V2d grain =
      gradient_of(chart.panel, chart.plane, down).normalized();  // where `down` goes in the plane
  // (u, v up): `grain` shall become (0, -1); then v is turned to grow downwards.
  Imath::Box2d box;
  for (V2d& p : chart.plane) {
    p = V2d(p.y * grain.x - p.x * grain.y, p.x * grain.x + p.y * grain.y);
    box.extendBy(p);
  }
  const V2d origin((box.min.x + box.max.x) / 2 - middle_u, box.min.y);
  for (V2d& p : chart.plane) p -= origin;
}

Patch patch_of(const Chart& chart, const std::string& material) {
  return {material, chart.points, chart.plane, chart.panel.triangles};
}

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
