#include "converter/dress/charts.h"

#include <Imath/ImathBox.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

#include "format/scene/flatten.h"

namespace selvedge {
namespace {

constexpr int none = -1;

using Face = std::array<std::uint32_t, 3>;

class Cutter {
 public:
  Cutter(const std::vector<V3d>& positions, const std::vector<std::uint32_t>& triangles, const V3d& down)
      : positions_(positions), down_(down), welded_(weld(positions)) {
    for (std::size_t t = 0; t + 2 < triangles.size(); t += 3)
      add({triangles[t], triangles[t + 1], triangles[t + 2]});
  }

  Charts cut(double& top) {
    find_neighbours();
    chart_of_ = parts(half_axes());
    join_small_parts();
    lay_flat();
    pack(top);
    return std::move(charts_);
  }

 private:
  std::array<V3d, 3> corners(std::size_t face) const {
    const Face& f = faces_[face];
    return {positions_[f[0]], positions_[f[1]], positions_[f[2]]};
  }

  void add(const Face& face) {
    constexpr double thinnest = 1e-9;  // height over length: invisible, and too steep for the equations
    const V3d a = positions_[face[1]] - positions_[face[0]];
    const V3d b = positions_[face[2]] - positions_[face[0]];
    const V3d normal = a.cross(b);
    const double longest = std::max({a.length2(), b.length2(), (b - a).length2()});
    if (!(normal.length() > thinnest * longest)) return;
    faces_.push_back(face);
    normals_.push_back(normal);
  }

  void find_neighbours() {
    // From the smaller vertex to the larger, and the face; odd where the face runs the other way.
    std::vector<std::tuple<std::uint32_t, std::uint32_t, std::size_t>> edges;
    for (std::size_t f = 0; f < faces_.size(); ++f) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = welded_[faces_[f][k]];
        const std::uint32_t b = welded_[faces_[f][(k + 1) % 3]];
        edges.emplace_back(std::min(a, b), std::max(a, b), 2 * (3 * f + k) + (a < b ? 0 : 1));
      }
    }
    std::ranges::sort(edges);
    neighbours_.assign(faces_.size(), {none, none, none});
    const auto same = [&](std::size_t i, std::size_t j) {
      return std::get<0>(edges[i]) == std::get<0>(edges[j]) && std::get<1>(edges[i]) == std::get<1>(edges[j]);
    };
    for (std::size_t i = 0; i < edges.size();) {
      std::size_t end = i + 1;
      while (end < edges.size() && same(i, end)) ++end;
      const std::size_t one = std::get<2>(edges[i]);
      const std::size_t other = std::get<2>(edges[end - 1]);
      if (end - i == 2 && one % 2 != other % 2) {
        neighbours_[one / 6][one / 2 % 3] = static_cast<int>(other / 6);
        neighbours_[other / 6][other / 2 % 3] = static_cast<int>(one / 6);
      }
      i = end;
    }
  }

  /// The half axis that is nearest to each face's normal among its neighbours'.
  std::vector<int> half_axes() const {
    constexpr int rounds = 8;
    std::vector<V3d> smooth = normals_;
    for (int round = 0; round < rounds; ++round) {
      std::vector<V3d> next = smooth;
      for (std::size_t f = 0; f < faces_.size(); ++f) {
        for (const int n : neighbours_[f]) {
          if (n != none) next[f] += smooth[n];
        }
        next[f] *= 0.25;
      }
      smooth = std::move(next);
    }
    std::vector<int> labels;
    for (const V3d& n : smooth) {
      int axis = 2;  // of equal ones, front and back
      for (const int other : {0, 1}) {
        if (std::abs(n[other]) > std::abs(n[axis])) axis = other;
      }
      labels.push_back(2 * axis + (n[axis] < 0 ? 1 : 0));
    }
    return labels;
  }

  /// Numbers of the parts of one label that hang together.
  std::vector<int> parts(const std::vector<int>& labels) const {
    std::vector<int> part(faces_.size(), none);
    int count = 0;
    std::vector<std::size_t> open;
    for (std::size_t seed = 0; seed < faces_.size(); ++seed) {
      if (part[seed] != none) continue;
      part[seed] = count;
      open.push_back(seed);
      while (!open.empty()) {
        const std::size_t face = open.back();
        open.pop_back();
        for (const int n : neighbours_[face]) {
          if (n == none || part[n] != none || labels[n] != labels[seed]) continue;
          part[n] = count;
          open.push_back(static_cast<std::size_t>(n));
        }
      }
      ++count;
    }
    return part;
  }

  void join_small_parts() {
    constexpr double small = 0.01;
    const std::vector<int> whole = parts(std::vector<int>(faces_.size(), 0));
    const auto sum_of = [&](const std::vector<int>& chart_ids) {
      std::vector<double> areas(chart_ids.empty() ? 0 : *std::ranges::max_element(chart_ids) + 1);
      for (std::size_t f = 0; f < faces_.size(); ++f) areas[chart_ids[f]] += normals_[f].length();
      return areas;
    };
    const std::vector<double> of_whole = sum_of(whole);
    std::vector<double> areas = sum_of(chart_of_);
    // Rounds, in each of which every small part that has a neighbour joins one: half as many are left.
    std::vector<int> joined(areas.size());  // the part that each has joined, or itself
    std::iota(joined.begin(), joined.end(), 0);
    const auto root = [&](int part) {
      while (joined[part] != part) part = joined[part] = joined[joined[part]];
      return part;
    };
    for (bool again = true; again;) {
      again = false;
      std::vector<std::tuple<int, int, double>> borders;  // of small parts, with whom, and how long
      for (std::size_t f = 0; f < faces_.size(); ++f) {
        const int part = root(chart_of_[f]);
        if (areas[part] >= small * of_whole[whole[f]]) continue;
        for (std::size_t k = 0; k < 3; ++k) {
          const int n = neighbours_[f][k];
          if (n == none || root(chart_of_[n]) == part) continue;
          borders.emplace_back(part, root(chart_of_[n]),
                               (positions_[faces_[f][(k + 1) % 3]] - positions_[faces_[f][k]]).length());
        }
      }
      std::ranges::sort(borders);
      for (std::size_t at = 0; at < borders.size();) {
        const int part = std::get<0>(borders[at]);
        int into = part;
        double longest = -1;
        while (at < borders.size() && std::get<0>(borders[at]) == part) {
          const int other = std::get<1>(borders[at]);
          double length = 0;
          for (; at < borders.size() && std::get<0>(borders[at]) == part && std::get<1>(borders[at]) == other;
               ++at)
            length += std::get<2>(borders[at]);
          if (length > longest) std::tie(into, longest) = std::pair(other, length);
        }
        const int from = root(part);
        const int to = root(into);
        if (from == to) continue;  // they have joined each other
        joined[from] = to;
        areas[to] += areas[from];
        again = true;
      }
    }
    std::vector<std::vector<std::size_t>> members(areas.size());
    for (std::size_t f = 0; f < faces_.size(); ++f) members[root(chart_of_[f])].push_back(f);
    std::erase_if(members, [](const auto& part) { return part.empty(); });
    members_ = std::move(members);
  }

  void lay_flat() {
    charts_.indices.resize(3 * faces_.size());
    charts_.stretch.resize(faces_.size());
    for (const std::vector<std::size_t>& faces : members_) {
      Panel panel;
      std::map<std::uint32_t, int> local;
      for (const std::size_t f : faces) {
        V3i triangle;
        for (int k = 0; k < 3; ++k) {
          const std::uint32_t v = welded_[faces_[f][k]];
          const auto [entry, fresh] = local.try_emplace(v, static_cast<int>(panel.positions.size()));
          if (fresh) panel.positions.push_back(positions_[v]);
          triangle[k] = entry->second;
        }
        panel.triangles.push_back(triangle);
      }
      std::vector<V2d> plane;
      if (is_simple(panel)) plane = flatten(panel);
      if (plane.empty() || !is_sound(panel, plane)) plane = projected(panel);
      for (V2d& p : plane) p.y = -p.y;  // v of glTF grows downwards
      turn(panel, plane);
      add_chart(faces, panel, local, plane);
    }
  }

  /// Whether the equations of a chart are as sparse as for a disc, by Euler's number: a hole takes one
  /// from it and a handle two, and many handles tie everything to everything. One triangle needs none.
  static bool is_simple(const Panel& panel) {
    constexpr std::ptrdiff_t max_holes = 64;
    std::vector<std::pair<int, int>> edges;
    for (const V3i& t : panel.triangles) {
      for (int k = 0; k < 3; ++k) edges.push_back(std::minmax(t[k], t[(k + 1) % 3]));
    }
    std::ranges::sort(edges);
    const std::ptrdiff_t unique = std::unique(edges.begin(), edges.end()) - edges.begin();
    return panel.triangles.size() > 1 &&
           std::ssize(panel.positions) - unique + std::ssize(panel.triangles) >= 1 - max_holes;
  }

  static double signed_area(const V3i& t, const std::vector<V2d>& plane) {
    return (plane[t[1]] - plane[t[0]]) % (plane[t[2]] - plane[t[0]]);
  }

  static bool is_sound(const Panel& panel, const std::vector<V2d>& plane) {
    return std::ranges::all_of(panel.triangles, [&](const V3i& t) { return signed_area(t, plane) > 0; });
  }

  static std::vector<V2d> projected(const Panel& panel) {
    V3d normal(0, 0, 0);
    for (const V3i& t : panel.triangles)
      normal += (panel.positions[t[1]] - panel.positions[t[0]])
                    .cross(panel.positions[t[2]] - panel.positions[t[0]]);
    normal = normal.length() > 0 ? normal.normalized() : V3d(0, 0, 1);
    const V3d x = normal.cross(std::abs(normal.x) < 0.5 ? V3d(1, 0, 0) : V3d(0, 1, 0)).normalized();
    const V3d y = normal.cross(x);
    std::vector<V2d> plane;
    for (const V3d& p : panel.positions) plane.emplace_back(p.dot(x), p.dot(y));
    return plane;
  }

  /// Turns the plane so that what hangs lower has a larger v in the mean.
  void turn(const Panel& panel, std::vector<V2d>& plane) const {
    V2d slope = gradient_of(panel, plane, down_);
    if (!(slope.length() > 0)) return;
    slope.normalize();
    for (V2d& p : plane) p = V2d(p.x * slope.y - p.y * slope.x, p.x * slope.x + p.y * slope.y);
  }

  void add_chart(const std::vector<std::size_t>& faces, const Panel& panel,
                 const std::map<std::uint32_t, int>& local, const std::vector<V2d>& plane) {
    std::map<std::uint32_t, std::uint32_t> fresh;  // by vertex of the surface
    Imath::Box2d box;
    for (const V2d& p : plane) box.extendBy(p);
    const std::size_t first = charts_.uvs.size();
    for (std::size_t i = 0; i < faces.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t v = faces_[faces[i]][k];
        const auto [entry, is_new] = fresh.try_emplace(v, static_cast<std::uint32_t>(charts_.sources.size()));
        if (is_new) {
          charts_.sources.push_back(v);
          charts_.uvs.push_back(plane[local.at(welded_[v])] - box.min);
        }
        charts_.indices[3 * faces[i] + k] = entry->second;
      }
      const V3i& t = panel.triangles[i];
      const Stretch s = stretch_of(corners(faces[i]), {plane[t[0]], plane[t[1]], plane[t[2]]});
      const double most = std::max(s.most, 1 / std::max(s.least, 1e-12));
      charts_.stretch[faces[i]] = {std::isfinite(most) ? most : 1e12, normals_[faces[i]].length() / 2};
    }
    placed_.push_back({box.size(), first, charts_.uvs.size()});
    ++charts_.count;
  }

  /// In rows, the tallest first.
  void pack(double& top) {
    constexpr double gap = 0.01;  // m
    std::ranges::stable_sort(placed_, [](const Placed& a, const Placed& b) { return a.size.y > b.size.y; });
    double area = 0;
    double width = 0;
    for (const Placed& p : placed_) {
      area += (p.size.x + gap) * (p.size.y + gap);
      width = std::max(width, p.size.x);
    }
    width = std::max(width, 1.2 * std::sqrt(area));
    V2d at(0, top);
    double below = top;
    for (const Placed& p : placed_) {
      if (at.x > 0 && at.x + p.size.x > width) at = V2d(0, below);
      for (std::size_t i = p.first; i < p.end; ++i) charts_.uvs[i] += at;
      at.x += p.size.x + gap;
      below = std::max(below, at.y + p.size.y + gap);
    }
    top = below;
  }

  /// A chart's place in the list of new vertices.
  struct Placed {
    V2d size;
    std::size_t first = 0;
    std::size_t end = 0;
  };

  const std::vector<V3d>& positions_;
  V3d down_;
  std::vector<std::uint32_t> welded_;
  std::vector<Face> faces_;
  std::vector<V3d> normals_;  ///< of faces, as long as twice their area
  std::vector<std::array<int, 3>> neighbours_;
  std::vector<int> chart_of_;
  std::vector<std::vector<std::size_t>> members_;
  std::vector<Placed> placed_;
  Charts charts_;
};

}  // namespace

std::vector<std::uint32_t> weld(const std::vector<V3d>& positions) {
  const auto key = [&](std::uint32_t i) { return std::tie(positions[i].x, positions[i].y, positions[i].z); };
  std::vector<std::uint32_t> order(positions.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::stable_sort(order, [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
  std::vector<std::uint32_t> first(positions.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    first[order[i]] = i > 0 && key(order[i]) == key(order[i - 1]) ? first[order[i - 1]] : order[i];
  return first;
}

Charts cut_into_charts(const std::vector<V3d>& positions, const std::vector<std::uint32_t>& triangles,
                       const V3d& down, double& top) {
  return Cutter(positions, triangles, down).cut(top);
}

double stretch_below(std::vector<ChartStretch> stretch, double share) {
  std::ranges::sort(stretch, [](const ChartStretch& a, const ChartStretch& b) { return a.most < b.most; });
  double total = 0;
  for (const ChartStretch& s : stretch) total += s.area;
  double sum = 0;
  for (const ChartStretch& s : stretch) {
    sum += s.area;
    if (sum >= share * total) return s.most;
  }
  return 1;
}

}  // namespace selvedge
