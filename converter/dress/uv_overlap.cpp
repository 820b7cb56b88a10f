#include "converter/dress/uv_overlap.h"

#include <Imath/ImathBox.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

namespace selvedge {
namespace {

constexpr std::uint64_t max_rows = std::uint64_t{1} << 28;

using Corners = std::array<V2d, 3>;  ///< in cells

/// Where the edge meets the row: the same number for both triangles at the edge.
double meet(V2d a, V2d b, double y) {
  if (std::pair(b.y, b.x) < std::pair(a.y, a.x)) std::swap(a, b);
  return a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y));
}

/// Calls visit(row, first, end) with the cells whose middles the triangle covers. A middle on an edge of two
/// triangles belongs to one of them.
template <class F>
void each_row(const Corners& corners, int side, const F& visit) {
  const auto cell = [&](double x) {
    return static_cast<int>(std::clamp(std::ceil(x - 0.5), 0.0, static_cast<double>(side)));
  };
  const auto [low, high] = std::minmax({corners[0].y, corners[1].y, corners[2].y});
  for (int row = cell(low); row < cell(high); ++row) {
    const double y = row + 0.5;
    double left = std::numeric_limits<double>::max();
    double right = std::numeric_limits<double>::lowest();
    for (int i = 0; i < 3; ++i) {
      const V2d& a = corners[i];
      const V2d& b = corners[(i + 1) % 3];
      if ((a.y <= y) == (b.y <= y)) continue;
      const double x = meet(a, b, y);
      left = std::min(left, x);
      right = std::max(right, x);
    }
    const int first = cell(left);
    const int end = cell(right);
    if (first < end) visit(row, first, end);
  }
}

class Overlap {
 public:
  Overlap(const Scene& scene, const std::set<int>& chosen, int tex_coord)
      : scene_(scene), chosen_(chosen), tex_coord_(tex_coord) {
    for (const int i : chosen_) {
      for (const V2d& uv : uvs_of(i)) bounds_.extendBy(uv);
    }
    for (const SceneInstance& instance : scene.instances)
      worlds_[instance.primitive].push_back(&instance.world);
    if (!bounds_.isEmpty()) cell_ = std::max(bounds_.size().x, bounds_.size().y) / overlap_side;
  }

  double share() {
    if (!(cell_ > 0) || !std::isfinite(cell_)) return 0;
    std::uint64_t rows = 0;
    each_triangle([&](int, std::size_t, const Corners& corners) {
      const auto [low, high] = std::minmax({corners[0].y, corners[1].y, corners[2].y});
      rows += 1 + static_cast<std::uint64_t>(high - low);
    });
    if (rows > max_rows) return 0;
    std::vector<std::uint8_t> covers(std::size_t{overlap_side} * overlap_side);
    each_triangle([&](int, std::size_t, const Corners& corners) {
      each_row(corners, overlap_side, [&](int row, int first, int end) {
        for (int x = first; x < end; ++x) {
          std::uint8_t& count = covers[std::size_t{overlap_side} * row + x];
          if (count < 2) ++count;
        }
      });
    });
    double all = 0;
    double shared = 0;
    each_triangle([&](int primitive, std::size_t triangle, const Corners& corners) {
      int seen = 0;
      int twice = 0;
      each_row(corners, overlap_side, [&](int row, int first, int end) {
        seen += end - first;
        for (int x = first; x < end; ++x) {
          if (covers[std::size_t{overlap_side} * row + x] > 1) ++twice;
        }
      });
      if (seen == 0) return;
      const double area = area_of(primitive, triangle);
      all += area;
      shared += area * twice / seen;
    });
    return all > 0 ? shared / all : 0;
  }

 private:
  const std::vector<V2d>& uvs_of(int primitive) const {
    return scene_.primitives[primitive].tex_coords[tex_coord_];
  }

  template <class F>
  void each_triangle(const F& visit) const {
    for (const int i : chosen_) {
      const std::vector<V2d>& uvs = uvs_of(i);
      const std::vector<std::uint32_t>& indices = scene_.primitives[i].indices;
      for (std::size_t t = 0; !uvs.empty() && t + 2 < indices.size(); t += 3) {
        Corners corners;
        for (int c = 0; c < 3; ++c) corners[c] = (uvs[indices[t + c]] - bounds_.min) / cell_;
        visit(i, t, corners);
      }
    }
  }

  /// Twice that of all instances.
  double area_of(int primitive, std::size_t triangle) const {
    const ScenePrimitive& p = scene_.primitives[primitive];
    double sum = 0;
    const auto worlds = worlds_.find(primitive);
    if (worlds == worlds_.end()) return 0;
    for (const M44d* world : worlds->second) {
      const V3d origin = V3d(p.positions[p.indices[triangle]]) * *world;
      const V3d e1 = V3d(p.positions[p.indices[triangle + 1]]) * *world - origin;
      const V3d e2 = V3d(p.positions[p.indices[triangle + 2]]) * *world - origin;
      sum += e1.cross(e2).length();
    }
    return std::isfinite(sum) ? sum : 0;
  }

  const Scene& scene_;
  const std::set<int>& chosen_;
  int tex_coord_;
  Imath::Box2d bounds_;
  double cell_ = 0;
  std::map<int, std::vector<const M44d*>> worlds_;  ///< of the instances of each primitive
};

}  // namespace

double overlap_of(const Scene& scene, const std::set<int>& chosen, int tex_coord) {
  if (tex_coord < 0 || tex_coord > 1) return 0;
  return Overlap(scene, chosen, tex_coord).share();
}

}  // namespace selvedge
