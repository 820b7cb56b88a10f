#include "converter/stitch/hairs.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace selvedge {
namespace {

/// Finds triangles by their middles, in squares of a grid over the cell.
class Triangles {
 public:
  explicit Triangles(const CellMesh& mesh) : period_(mesh.period) {
    const double side =
        std::sqrt(period_.x * period_.y / (1 + static_cast<double>(mesh.triangles.size()) / 32));
    for (int i = 0; i < 2; ++i) count_[i] = std::max(1, static_cast<int>(period_[i] / side));
    squares_.resize(static_cast<std::size_t>(count_.x) * count_.y);
    for (const V3i& t : mesh.triangles) {
      middles_.push_back((V3d(mesh.positions[t.x]) + V3d(mesh.positions[t.y]) + V3d(mesh.positions[t.z])) /
                         3.0);
      const V2i at = square_at(middles_.back());
      squares_[square(at.x, at.y)].push_back(static_cast<int>(middles_.size()) - 1);
    }
  }

  /// The one whose middle is nearest: within a square's width for sure, or of all where there is none so
  /// near.
  int nearest(const V3d& point) const {
    int best = -1;
    double least = std::numeric_limits<double>::max();
    const V2i at = square_at(point);
    for (int reach = 1; best < 0; reach *= 4) {
      for (int y = at.y - reach; y <= at.y + reach; ++y) {
        for (int x = at.x - reach; x <= at.x + reach; ++x) {
          for (const int t : squares_[square(x, y)]) {
            V3d off = middles_[t] - point;
            for (int i = 0; i < 2; ++i) off[i] -= std::round(off[i] / period_[i]) * period_[i];
            if (off.length2() >= least) continue;
            least = off.length2();
            best = t;
          }
        }
      }
    }
    return best;
  }

 private:
  V2i square_at(const V3d& point) const {
    V2i at;
    for (int i = 0; i < 2; ++i) at[i] = static_cast<int>(std::floor(point[i] / period_[i] * count_[i]));
    return at;
  }
  /// Index of a square, which repeats with the cell.
  std::size_t square(int x, int y) const {
    const auto wrapped = [](int a, int n) { return (a % n + n) % n; };
    return static_cast<std::size_t>(wrapped(y, count_.y)) * count_.x + wrapped(x, count_.x);
  }

  V2d period_;
  V2i count_;
  std::vector<V3d> middles_;
  std::vector<std::vector<int>> squares_;
};

}  // namespace

Hairs grow_hairs(const CellMesh& mesh) {
  Hairs hairs;
  const Triangles triangles(mesh);
  const V2f period(mesh.period);
  for_each_curve(mesh.yarns, [&](std::size_t, const YarnCurve& curve, std::span<const V3f> nodes) {
    if (curve.hairs.count == 0) return;
    for (const YarnHair& hair : hairs_of(curve, nodes, period, segments_of(curve, nodes, period))) {
      const V3d& root = hair.points[0];
      const V3d shift(std::floor(root.x / mesh.period.x) * mesh.period.x,
                      std::floor(root.y / mesh.period.y) * mesh.period.y, 0);
      for (const V3d& point : hair.points) hairs.points.emplace_back(point - shift);
      hairs.roots.push_back(triangles.nearest(root - shift));
      hairs.radius.push_back(curve.hairs.radius);
      hairs.passed.push_back(1 - curve.hairs.kept);
    }
  });
  return hairs;
}

}  // namespace selvedge
