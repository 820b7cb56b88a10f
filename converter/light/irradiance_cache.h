// An irradiance cache: indirect light, computed once per point of the yarn and light and shared by all views,
// as in Daubert et al. 2001, section 4. Irradiance is known at points of the mesh and interpolated between
// them.
//
// The points are the mesh's vertices; triangles larger than a twentieth of the longer period, and those at
// creases, get points of their own inside. From each point 64 directions, distributed by the cosine, meet
// other points, which is a matrix W; with the direct irradiance E0 and the albedo a the irradiance after
// k + 1 reflections is S = W a (E0 + S) after k.
//
// Approximations: irradiance and the light that others send are linear between the points, and sent as
// by Lambert; the share that a gloss reflects goes the same way in all directions. Directions that meet the
// inside of closed yarn count as dark. docs/bake.md has the measured error.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "converter/light/ray_scene.h"

namespace selvedge {

/// Three points and their weights (sum 1).
struct CacheTaps {
  std::array<int, 3> point{0, 0, 0};
  std::array<float, 3> weight{0, 0, 0};
};

class IrradianceCache {
 public:
  /// Nothing where more than max_cache_points would be needed: the mesh is for the path tracer.
  static std::optional<IrradianceCache> build(const RayScene& scene, std::uint64_t seed);

  int points() const { return static_cast<int>(position_.size()); }
  /// Rays that building and solving took.
  std::uint64_t rays() const { return rays_; }

  /// The points around a point that a ray met; false on the inside of closed yarn, where there is no light.
  bool taps(const SurfacePoint& at, CacheTaps& taps) const;

  /// Indirect irradiance of all points for each light's unit perpendicular irradiance, after 1 to `bounces`
  /// reflections (or until nothing changes any more): [point][channel][light].
  std::vector<float> solve(const RayScene& scene, std::span<const V3f> lights, int bounces);

 private:
  struct Patch {
    int first = -1;  ///< of its own points; none: its corners serve
    int parts = 1;   ///< parts of an edge
  };
  void place_points(const RayScene& scene);
  void order_points(const RayScene& scene);
  void gather(const RayScene& scene, std::uint64_t seed);
  std::vector<float> solve_some(const RayScene& scene, std::span<const V3f> lights, int bounces);
  std::vector<float> light_directly(const RayScene& scene, std::span<const V3f> lights);

  std::vector<V3i> triangles_;
  std::vector<Patch> patches_;  ///< per triangle
  int sides_ = 1;               ///< 2: points on both sides of the triangles, the back's after each front's
  std::vector<V3f> position_;
  std::vector<V3f> normal_;
  std::vector<V3f> albedo_;  ///< with what the gloss reflects
  std::vector<int> order_;   ///< the points so that neighbours in space follow each other
  // W, row by row.
  std::vector<std::size_t> row_start_;
  std::vector<int> column_;
  std::vector<float> weight_;
  std::uint64_t rays_ = 0;
};

/// More would not fit into memory.
inline constexpr int max_cache_points = 50000;

/// The irradiance for one of `lights` lights out of what solve() gives: [point][channel].
std::vector<float> light_column(const std::vector<float>& irradiance, std::size_t lights, std::size_t light);

}  // namespace selvedge
