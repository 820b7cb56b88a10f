#include "viewer/needed_levels.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace selvedge {
namespace {

/// Lowers the bound by less than a thousandth of a level, for what floats round away.
constexpr double rounding = 1e-3;

/// What a pixel at depth 1 spans at least across any surface. A pixel's disc falls on a surface along the ray
/// through it; no surface catches less than what lies across the ray.
double least_span(const Camera& camera, int height) {
  const double pixel = 2 * camera.window_half.y / height;
  if (camera.projection == Projection::parallel)
    return pixel * std::abs(camera.to_viewer.dot(camera.back())) / camera.to_viewer.length();
  const V2d farthest(std::abs(camera.window_centre.x) + camera.window_half.x,
                     std::abs(camera.window_centre.y) + camera.window_half.y);
  return pixel / std::sqrt(1 + farthest.length2());
}

/// The smaller of the two stretches from the plane of a triangle to its texture: texels per metre. 0 where
/// the triangle has no area, which no pixel sees.
double least_stretch(const std::array<V3d, 3>& p, const std::array<V2d, 3>& texels) {
  const V3d a = p[1] - p[0];
  const V3d b = p[2] - p[0];
  const V3d x = a.normalized();
  const double along = b.dot(x);
  const double across = (b - x * along).length();
  const double length = a.length();
  if (!(length * across > 0)) return HUGE_VAL;
  // Columns of the Jacobian: texels per metre along x and across it.
  const V2d s = (texels[1] - texels[0]) / length;
  const V2d t = (texels[2] - texels[0] - s * along) / across;
  const double trace = s.length2() + t.length2();
  const double determinant = s.x * t.y - s.y * t.x;
  const double root = std::sqrt(std::max(trace * trace - 4 * determinant * determinant, 0.0));
  // The smaller eigenvalue without cancellation.
  return std::sqrt(2 * determinant * determinant / (trace + root));
}

class LevelBound {
 public:
  LevelBound(const Camera& camera, int height)
      : camera_(camera), clip_(clip_matrix(camera, V3d(0, 0, 0))), span_(least_span(camera, height)) {}

  /// At least so many texels across a pixel that sees the triangle; infinite where none does.
  double texels_per_pixel(const std::array<V3d, 3>& p, const std::array<V2d, 3>& texels) const {
    double depth = HUGE_VAL;
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
      depth = std::min(depth, (camera_.position - corner).dot(camera_.back()));
    }
    if (std::any_of(outside.begin(), outside.end(), [](int n) { return n == 3; })) return HUGE_VAL;
    if (camera_.projection == Projection::parallel) depth = 1;
    return least_stretch(p, texels) * span_ * std::max(depth, camera_.near);
  }

 private:
  const Camera& camera_;
  M44d clip_;
  double span_;
};

bool is_power_of_two(int n) { return n > 0 && std::has_single_bit(static_cast<unsigned>(n)); }

}  // namespace

std::vector<int> finest_levels(const Scene& scene, const Camera& camera, int height,
                               const LevelOptions& options, std::span<const V2i> sizes,
                               std::span<const int> counts) {
  const LevelBound bound(camera, height);
  std::vector<double> least(sizes.size(), HUGE_VAL);
  for (const SceneInstance& instance : scene.instances) {
    const ScenePrimitive& primitive = scene.primitives[static_cast<std::size_t>(instance.primitive)];
    if (primitive.material < 0) continue;
    const SceneMaterial& material = scene.materials[static_cast<std::size_t>(primitive.material)];
    if (!material.fabric) continue;
    const auto fabric = static_cast<std::size_t>(material.fabric->fabric);
    const auto set = static_cast<std::size_t>(material.fabric->tex_coord);
    if (set >= primitive.tex_coords.size() ||
        primitive.tex_coords[set].size() != primitive.positions.size()) {
      least[fabric] = 0;  // the renderer says what is wrong with it
      continue;
    }
    for (std::size_t k = 0; k + 2 < primitive.indices.size(); k += 3) {
      std::array<V3d, 3> p;
      std::array<V2d, 3> texels;
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t vertex = primitive.indices[k + i];
        instance.world.multVecMatrix(V3d(primitive.positions[vertex]), p[i]);
        texels[i] = material.fabric->transform.apply(primitive.tex_coords[set][vertex]) * V2d(sizes[fabric]);
      }
      // NaN is not less than anything, and must not hide a level.
      const double here = bound.texels_per_pixel(p, texels);
      if (!(here >= least[fabric])) least[fabric] = std::isnan(here) ? 0 : here;
    }
  }
  std::vector<int> levels;
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const double level = std::log2(std::max(least[i], 1e-30)) + static_cast<double>(options.bias) - rounding;
    const double last = counts[i] - 1;
    // The first level that is there counts as level 0, whose texels keep their edges: with linear taps the
    // levels that are seen lie behind it.
    const double spare = options.linear ? 1 : 0;
    const bool halves = is_power_of_two(sizes[i].x) && is_power_of_two(sizes[i].y);
    levels.push_back(halves ? static_cast<int>(std::clamp(std::floor(level) - spare, 0.0, last)) : 0);
  }
  return levels;
}

}  // namespace selvedge
