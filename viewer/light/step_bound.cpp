#include "viewer/light/step_bound.h"

#include <algorithm>
#include <cmath>

namespace selvedge {
namespace {

/// Largest singular value of the map from the plane of a triangle to its texture, units per metre;
/// infinite without area: no pixel sees the triangle.
double stretch_of(const std::array<V3d, 3>& p, const std::array<V2d, 3>& at) {
  const V3d a = p[1] - p[0];
  const V3d b = p[2] - p[0];
  const V3d x = a.normalized();
  const double along = b.dot(x);
  const double across = (b - x * along).length();
  const double length = a.length();
  if (!(length * across > 0)) return HUGE_VAL;
  // Columns of the Jacobian: units per metre along x and across it.
  const V2d s = (at[1] - at[0]) / length;
  const V2d t = (at[2] - at[0] - s * along) / across;
  const double trace = s.length2() + t.length2();
  const double determinant = s.x * t.y - s.y * t.x;
  const double root = std::sqrt(std::max(trace * trace - 4 * determinant * determinant, 0.0));
  return std::sqrt((trace + root) / 2);
}

/// Lower bounds of pixels' footprints on triangles.
class CameraSpans {
 public:
  CameraSpans(const Camera& camera, int height)
      : camera_(camera), clip_(clip_matrix(camera, V3d(0, 0, 0))), pixel_(2 * camera.window_half.y / height) {
    const V2d farthest(std::abs(camera.window_centre.x) + camera.window_half.x,
                       std::abs(camera.window_centre.y) + camera.window_half.y);
    max_slope2_ = farthest.length2();
  }

  /// Of the shorter axis of a footprint, m; infinite: no pixel sees the triangle.
  double operator()(const std::array<V3d, 3>& p) const {
    double nearest = HUGE_VAL;
    double slope2 = 0;  // squared tangent of the angle between the axis and the ray to a corner
    std::array<int, 4> outside{};
    for (const V3d& corner : p) {
      const auto row = [&](unsigned k) {
        return corner.x * clip_[0][k] + corner.y * clip_[1][k] + corner.z * clip_[2][k] + clip_[3][k];
      };
      const double w = row(3);
      outside[0] += row(0) < -w ? 1 : 0;
      outside[1] += row(0) > w ? 1 : 0;
      outside[2] += row(1) < -w ? 1 : 0;
      outside[3] += row(1) > w ? 1 : 0;
      const V3d away = camera_.position - corner;
      const double depth = away.dot(camera_.back());
      nearest = std::min(nearest, depth);
      slope2 = std::max(slope2, away.length2() / (depth * depth) - 1);
    }
    if (std::ranges::any_of(outside, [](int n) { return n == 3; })) return HUGE_VAL;
    if (camera_.projection == Projection::parallel)
      return pixel_ * std::abs(camera_.to_viewer.normalized().dot(camera_.back()));
    // The footprint is the projection of the pixel's disc along the ray: never smaller than the disc.
    if (!(nearest > 0) || !(slope2 < max_slope2_)) slope2 = max_slope2_;
    return pixel_ * std::max(nearest, camera_.near) / std::sqrt(1 + slope2);
  }

 private:
  const Camera& camera_;
  M44d clip_;
  double pixel_;
  double max_slope2_ = 0;  ///< of the largest angle between a ray of the frame and the axis
};

}  // namespace

StepBound step_bound(const Camera& camera, int height) {
  return [spans_of = CameraSpans(camera, height)](const std::array<V3d, 3>& points,
                                                  const std::array<V2d, 3>& at) {
    const double stretch = stretch_of(points, at);
    const double span = spans_of(points);
    if (stretch == HUGE_VAL || span == HUGE_VAL) return HUGE_VAL;
    // The longer of two columns is at least the longest image of the unit circle, over the root of two.
    const double step = stretch * span / std::sqrt(2.0);
    return std::isnan(step) ? 0.0 : step;
  };
}

}  // namespace selvedge
