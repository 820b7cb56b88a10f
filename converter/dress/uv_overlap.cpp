#include "converter/dress/uv_overlap.h"

#include <Imath/ImathBox.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

namespace selvedge {
namespace {

/// What the cells of a grid take, in rows of a triangle.
constexpr std::uint64_t grid_price = std::uint64_t{overlap_side} * overlap_side / 16;

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
      : scene_(scene), tex_coord_(tex_coord) {
    // A mesh in two skins is two primitives in the scene, on one chart that it shares with nobody.
    std::set<std::pair<int, int>> places;
    for (const int i : chosen) {
      if (places.emplace(scene.primitives[i].mesh, scene.primitives[i].index).second) chosen_.push_back(i);
    }
    for (const int i : chosen_) {
      worlds_[i];
      for (const V2d& uv : uvs_of(i)) bounds_.extendBy(uv);
    }
    for (const SceneInstance& instance : scene.instances) {
      if (const auto of = worlds_.find(instance.primitive); of != worlds_.end())
        of->second.push_back(&instance.world);
    }
    if (!bounds_.isEmpty()) cell_ = std::max(bounds_.size().x, bounds_.size().y) / overlap_side;
  }

  std::optional<double> share(OverlapBudget& budget) {
    if (!(cell_ > 0) || !std::isfinite(cell_)) return 0;
    std::uint64_t rows = grid_price;
    each_triangle([&](int, std::size_t, const Corners& corners) {
      const auto [low, high] = std::minmax({corners[0].y, corners[1].y, corners[2].y});
      rows += 1 + static_cast<std::uint64_t>(high - low);
    });
    if (rows > budget.rows) return std::nullopt;
    budget.rows -= rows;
    // At first how many more triangles cover a cell than the one before it, and then how many of the cells
    // before it in its row are covered twice: each row of a triangle is two numbers, however wide it is.
    constexpr std::size_t stride = overlap_side + 1;
    std::vector<std::int64_t> cells(stride * overlap_side);
    each_triangle([&](int, std::size_t, const Corners& corners) {
      each_row(corners, overlap_side, [&](int row, int first, int end) {
        ++cells[stride * row + first];
        --cells[stride * row + end];
      });
    });
    for (std::size_t row = 0; row < overlap_side; ++row) {
      std::int64_t covers = 0;
      std::int64_t shared_before = 0;
      for (std::size_t x = 0; x < stride; ++x) {
        std::int64_t& cell = cells[stride * row + x];
        covers += cell;
        cell = shared_before;
        if (covers > 1) ++shared_before;
      }
    }
    double all = 0;
    double shared = 0;
    each_triangle([&](int primitive, std::size_t triangle, const Corners& corners) {
      std::int64_t seen = 0;
      std::int64_t twice = 0;
      each_row(corners, overlap_side, [&](int row, int first, int end) {
        seen += end - first;
        twice += cells[stride * row + end] - cells[stride * row + first];
      });
      if (seen == 0) return;
      const double area = area_of(primitive, triangle);
      all += area;
      shared += area * static_cast<double>(twice) / static_cast<double>(seen);
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
    for (const M44d* world : worlds_.at(primitive)) {
      const V3d origin = V3d(p.positions[p.indices[triangle]]) * *world;
      const V3d e1 = V3d(p.positions[p.indices[triangle + 1]]) * *world - origin;
      const V3d e2 = V3d(p.positions[p.indices[triangle + 2]]) * *world - origin;
      sum += e1.cross(e2).length();
    }
    return std::isfinite(sum) ? sum : 0;
  }

  const Scene& scene_;
  std::vector<int> chosen_;
  int tex_coord_;
  Imath::Box2d bounds_;
  double cell_ = 0;
  std::map<int, std::vector<const M44d*>> worlds_;  ///< of the instances of each primitive
};

}  // namespace

std::optional<double> overlap_of(const Scene& scene, const std::set<int>& chosen, int tex_coord,
                                 OverlapBudget& budget) {
  if (tex_coord < 0 || tex_coord > 1) return 0;
  return Overlap(scene, chosen, tex_coord).share(budget);
}

}  // namespace selvedge
