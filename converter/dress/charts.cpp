#include "converter/dress/charts.h"

#include <Imath/ImathBox.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "converter/dress/flatten.h"
#include "format/base/disjoint_sets.h"

namespace selvedge {
namespace {

using Face = std::array<std::uint32_t, 3>;
constexpr int none = -1;  // of vertices and sides

class Cutter {
 public:
  Cutter(const std::vector<V3d>& positions, const std::vector<std::uint32_t>& triangles, const V3d& down)
      : positions_(positions), down_(down) {
    for (std::size_t t = 0; t + 2 < triangles.size(); t += 3)
      add({triangles[t], triangles[t + 1], triangles[t + 2]});
  }

  Charts cut(double& top) {
    build_mesh();
    chart_of_ = parts(half_axes());
    join_small_parts();
    lay_flat();
    pack(top);
    return std::move(charts_);
  }

 private:
  V3d normal_of(const Face& face) const {  ///< as long as twice its area
    return (positions_[face[1]] - positions_[face[0]]).cross(positions_[face[2]] - positions_[face[0]]);
  }

  void add(const Face& face) {
    constexpr double thinnest = 1e-9;  // height over length: invisible, and too steep for the equations
    double longest = 0;
    for (std::size_t k = 0; k < 3; ++k)
      longest = std::max(longest, (positions_[face[(k + 1) % 3]] - positions_[face[k]]).length2());
    if (normal_of(face).length() > thinnest * longest) faces_.push_back(face);
  }

  /// The size of a triangle in the middle.
  double size_of_face() const {
    if (faces_.empty()) return 0;
    std::vector<double> areas;
    for (const Face& face : faces_) areas.push_back(normal_of(face).length());
    const auto middle = areas.begin() + std::ssize(areas) / 2;
    std::ranges::nth_element(areas, middle);
    return std::sqrt(*middle);
  }

  /// Numbers of faces, each with an edge that an earlier one has, too, where there is one.
  std::vector<std::size_t> in_reach(const std::vector<std::uint32_t>& welded) const {
    constexpr int max_faces = 8;  // looked at on one edge
    std::vector<std::tuple<std::uint32_t, std::uint32_t, std::size_t>> edges;
    const auto edge = [&](std::size_t face, std::size_t k) {
      return std::minmax(welded[faces_[face][k]], welded[faces_[face][(k + 1) % 3]]);
    };
    for (std::size_t f = 0; f < faces_.size(); ++f)
      for (std::size_t k = 0; k < 3; ++k) edges.emplace_back(edge(f, k).first, edge(f, k).second, f);
    std::ranges::sort(edges);
    std::vector<bool> reached(faces_.size(), false);
    std::vector<std::size_t> order;
    const auto reach = [&](std::size_t face) {
      if (!reached[face]) order.push_back(face);
      reached[face] = true;
    };
    for (std::size_t seed = 0, at = 0; seed < faces_.size(); ++seed) {
      reach(seed);
      for (; at < order.size(); ++at) {
        const std::size_t face = order[at];
        for (std::size_t k = 0; k < 3; ++k) {
          const auto [a, b] = edge(face, k);
          auto other = std::ranges::lower_bound(edges, std::tuple(a, b, std::size_t{0}));
          for (int n = 0; n < max_faces && other != edges.end(); ++n, ++other) {
            if (std::get<0>(*other) != a || std::get<1>(*other) != b) break;
            reach(std::get<2>(*other));
          }
        }
      }
    }
    return order;
  }

  void build_mesh() {
    const std::vector<std::uint32_t> welded = weld(positions_, 3e-3 * size_of_face());
    std::vector<std::size_t> open = in_reach(welded);
    // Sheets of faces; those that one refuses both ways are left to the next, and at last each has vertices
    // of its own.
    constexpr int sheets = 8;
    for (int sheet = 0; !open.empty(); ++sheet) {
      std::vector<int> vertices(positions_.size(), none);
      std::set<Face> seen;
      std::vector<std::size_t> refused;
      for (const std::size_t number : open) {
        Face corners;
        std::array<int, 3> own{none, none, none};
        for (std::size_t k = 0; k < 3; ++k) {
          corners[k] = welded[faces_[number][k]];
          int& vertex = sheet < sheets ? vertices[corners[k]] : own[k];
          if (vertex == none) {
            vertex = static_cast<int>(points_.size());
            points_.push_back(positions_[corners[k]]);
          }
          own[k] = vertex;
        }
        std::ranges::sort(corners);
        const bool fits = corners[0] != corners[1] && corners[1] != corners[2] && seen.insert(corners).second;
        bool added = false;
        for (const bool turned : {false, true}) {
          if (added || (!fits && sheet < sheets)) continue;
          added = add_to_mesh({own[0], own[turned ? 2 : 1], own[turned ? 1 : 2]});
          if (!added) continue;
          numbers_.push_back(number);
          turned_.push_back(turned);
          normals_.push_back(normal_of(faces_[number]) * (turned ? -1 : 1));
        }
        if (!added) refused.push_back(number);
      }
      open = std::move(refused);
    }
  }

  /// Adds a face with corners in this order; false where an edge has a face on that side.
  bool add_to_mesh(const V3i& corners) {
    const auto key = [&](int from, int to) { return std::pair(corners[from % 3], corners[to % 3]); };
    for (int k = 0; k < 3; ++k)
      if (halves_.contains(key(k, k + 1))) return false;
    for (int k = 0; k < 3; ++k) {
      const auto half = static_cast<int>(opposite_.size());
      halves_[key(k, k + 1)] = half;
      const auto other = halves_.find(key(k + 1, k));
      opposite_.push_back(other == halves_.end() ? none : other->second);
      if (other != halves_.end()) opposite_[other->second] = half;
    }
    corners_.push_back(corners);
    return true;
  }

  /// Calls visit(half, half on the other side) for each edge of two faces.
  template <class Visit>
  void visit_inner_edges(const Visit& visit) const {
    for (int half = 0; half < std::ssize(opposite_); ++half)
      if (opposite_[half] > half) visit(half, opposite_[half]);
  }

  /// The half axis that is nearest to each face's normal among its neighbours'.
  std::vector<int> half_axes() const {
    constexpr int rounds = 8;
    std::vector<V3d> smooth = normals_;
    for (int round = 0; round < rounds; ++round) {
      std::vector<V3d> next = smooth;
      for (std::size_t f = 0; f < faces_.size(); ++f) {
        for (std::size_t half = 3 * f; half < 3 * f + 3; ++half)
          if (opposite_[half] != none) next[f] += smooth[opposite_[half] / 3];
        next[f] *= 0.25;
      }
      smooth = std::move(next);
    }
    std::vector<int> labels;
    for (const V3d& n : smooth) {
      int axis = 2;  // of equal ones, front and back
      for (const int other : {0, 1})
        if (std::abs(n[other]) > std::abs(n[axis])) axis = other;
      labels.push_back(2 * axis + (n[axis] < 0 ? 1 : 0));
    }
    return labels;
  }

  /// The faces of one label that hang together have one number, of the first of them.
  std::vector<int> parts(const std::vector<int>& labels) const {
    DisjointSets sets(faces_.size());
    visit_inner_edges([&](int half, int other) {
      const int a = sets.root(half / 3), b = sets.root(other / 3);
      if (labels[a] == labels[b]) sets.unite(std::max(a, b), std::min(a, b));
    });
    std::vector<int> part;
    for (int face = 0; face < static_cast<int>(faces_.size()); ++face) part.push_back(sets.root(face));
    return part;
  }

  void join_small_parts() {
    constexpr double small = 0.01;
    const std::vector<int> whole = parts(std::vector<int>(faces_.size(), 0));
    std::vector<double> areas(faces_.size(), 0);
    std::vector<double> wholes(faces_.size(), 0);
    for (std::size_t f = 0; f < faces_.size(); ++f) {
      areas[chart_of_[f]] += normals_[f].length();
      wholes[whole[f]] += normals_[f].length();
    }
    // Rounds, in each of which every small part that has a neighbour joins one: half as many are left.
    DisjointSets joined(areas.size());
    for (bool again = true; again;) {
      again = false;
      std::map<std::pair<int, int>, double> borders;  // of small parts, with whom, and how long
      visit_inner_edges([&](int half, int twin) {
        const V3i& ends = corners_[half / 3];
        const double length = (points_[ends[(half + 1) % 3]] - points_[ends[half % 3]]).length();
        for (const auto& [face, beside] : {std::pair(half / 3, twin / 3), std::pair(twin / 3, half / 3)}) {
          const int part = joined.root(chart_of_[face]), other = joined.root(chart_of_[beside]);
          if (part != other && areas[part] < small * wholes[whole[face]]) borders[{part, other}] += length;
        }
      });
      for (auto at = borders.begin(); at != borders.end();) {
        const int part = at->first.first;
        auto longest = at;
        for (; at != borders.end() && at->first.first == part; ++at)
          if (at->second > longest->second) longest = at;
        const int from = joined.root(part);
        const int to = joined.root(longest->first.second);
        if (from == to) continue;  // they have joined each other
        joined.unite(from, to);
        areas[to] += areas[from];
        again = true;
      }
    }
    for (int& part : chart_of_) part = joined.root(part);
  }

  void lay_flat() {
    charts_.indices.resize(3 * faces_.size());
    std::map<int, std::vector<std::size_t>> members;
    for (std::size_t f = 0; f < faces_.size(); ++f) members[chart_of_[f]].push_back(f);
    for (const auto& [chart, faces] : members) {
      ClothPanel panel;
      std::map<int, int> local;
      for (const std::size_t f : faces) {
        V3i triangle;
        for (int k = 0; k < 3; ++k) {
          const int vertex = corners_[f][k];
          const auto [entry, fresh] = local.try_emplace(vertex, static_cast<int>(panel.positions.size()));
          if (fresh) panel.positions.push_back(points_[vertex]);
          triangle[k] = entry->second;
        }
        panel.triangles.push_back(triangle);
      }
      std::vector<V2d> plane;
      if (is_simple(faces, panel)) plane = flatten(panel);
      if (plane.empty() || !is_sound(panel, plane)) plane = projected(panel);
      for (V2d& p : plane) p.y = -p.y;  // v of glTF grows downwards
      turn(panel, plane);
      add_chart(faces, panel, plane);
    }
  }

  /// Whether the equations of a chart are as sparse as for a disc, by Euler's number: a hole takes one
  /// from it and a handle two, and many handles tie everything to everything. One triangle needs none.
  bool is_simple(const std::vector<std::size_t>& faces, const ClothPanel& panel) const {
    constexpr std::ptrdiff_t max_holes = 64;
    std::ptrdiff_t halves = 0;  // of edges
    for (const std::size_t f : faces)
      for (std::size_t half = 3 * f; half < 3 * f + 3; ++half)
        halves += opposite_[half] != none && chart_of_[opposite_[half] / 3] == chart_of_[f] ? 1 : 2;
    return faces.size() > 1 && std::ssize(panel.positions) - halves / 2 + std::ssize(faces) >= 1 - max_holes;
  }

  static double signed_area(const V3i& t, const std::vector<V2d>& plane) {
    return (plane[t[1]] - plane[t[0]]) % (plane[t[2]] - plane[t[0]]);
  }

  static bool is_sound(const ClothPanel& panel, const std::vector<V2d>& plane) {
    return std::ranges::all_of(panel.triangles, [&](const V3i& t) { return signed_area(t, plane) > 0; });
  }

  static std::vector<V2d> projected(const ClothPanel& panel) {
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
  void turn(const ClothPanel& panel, std::vector<V2d>& plane) const {
    V2d slope = area_weighted_gradient(panel, plane, down_);
    if (!(slope.length() > 0)) return;
    slope.normalize();
    for (V2d& p : plane) p = V2d(p.x * slope.y - p.y * slope.x, p.x * slope.x + p.y * slope.y);
  }

  void add_chart(const std::vector<std::size_t>& faces, const ClothPanel& panel,
                 const std::vector<V2d>& plane) {
    std::map<std::pair<std::uint32_t, int>, std::uint32_t> fresh;  // by vertices of surface and panel
    Imath::Box2d box;
    for (const V2d& p : plane) box.extendBy(p);
    const std::size_t first = charts_.uvs.size();
    for (std::size_t i = 0; i < faces.size(); ++i) {
      const std::size_t number = numbers_[faces[i]];
      for (int k = 0; k < 3; ++k) {
        const auto corner = static_cast<std::size_t>(turned_[faces[i]] ? (3 - k) % 3 : k);
        const std::uint32_t source = faces_[number][corner];
        const int flat = panel.triangles[i][k];
        const auto [entry, is_new] = fresh.try_emplace({source, flat}, charts_.source_vertices.size());
        if (is_new) {
          charts_.source_vertices.push_back(source);
          charts_.uvs.push_back(plane[flat] - box.min);
        }
        charts_.indices[3 * number + corner] = entry->second;
      }
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
  std::vector<V3d> points_;    ///< by vertex of the mesh
  std::vector<V3i> corners_;   ///< of faces of the mesh, whose edges have two faces, one on each side
  std::vector<int> opposite_;  ///< by 3 * face + k, the side of an edge from corner k on: the other side
  std::map<std::pair<int, int>, int> halves_;  ///< sides by the vertices of their edges
  std::vector<Face> faces_;                    ///< of the surface, those with an area
  std::vector<std::size_t> numbers_;           ///< by face of the mesh, as all below: in faces_
  std::vector<bool> turned_;  ///< its corners run the other way in the mesh, as its neighbours' do
  std::vector<V3d> normals_;  ///< as long as twice the area
  std::vector<int> chart_of_;
  std::vector<Placed> placed_;
  Charts charts_;
};

}  // namespace

Charts cut_into_charts(const std::vector<V3d>& positions, const std::vector<std::uint32_t>& triangles,
                       const V3d& down, double& top) {
  return Cutter(positions, triangles, down).cut(top);
}

}  // namespace selvedge
