// An irradiance cache: indirect light, computed once per point of the yarn and light and shared by all views,
// as in Daubert et al. 2001, section 4. Irradiance is stored at points of the mesh and interpolated between
// them.
//
// The points are the mesh's vertices; triangles larger than a twentieth of the longer period, and those at
// creases, get additional points inside. From each point 64 cosine-distributed rays meet other points, which
// gives a matrix W; with the direct irradiance E0 and the albedo a, the irradiance after k + 1 reflections is
// S = W a (E0 + S) with the S after k. Where light passes through walls, each point has one on the other
// side, and sends the fraction of that one's light, too, that comes through.
//
// Approximations: irradiance and reflected light are linear between the points, and reflection is Lambertian,
// the fraction of a gloss included. Rays that meet the inside of closed opaque yarn count as dark.
// docs/bake.md has the measured error.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "converter/light/ray_scene.h"

namespace selvedge {

/// Points of a side at most.
inline constexpr std::size_t max_cache_points = 200'000;

/// Three points and their weights (sum 1).
struct CacheTaps {
  std::array<int, 3> point{0, 0, 0};
  std::array<int, 3> other_side{0, 0, 0};  ///< the points behind these, if the scene is translucent
  std::array<float, 3> weight{0, 0, 0};
};

class IrradianceCache {
 public:
  /// Nothing if the mesh needs more than max_cache_points; it is left to the path tracer. `from_below`: views
  /// and lights come from below as well.
  static std::optional<IrradianceCache> build(const RayScene& scene, std::uint64_t seed,
                                              bool from_below = false);

  int points() const { return static_cast<int>(albedo_.size()); }
  /// Rays of build() and solve() so far.
  std::uint64_t rays() const { return rays_; }

  /// The points around `point` and their weights; false on the unlit inside of closed opaque yarn.
  bool taps(const SurfacePoint& point, CacheTaps& taps) const;
  /// Indirect irradiance of all points per unit perpendicular irradiance of each light, after 1 to `bounces`
  /// reflections (or until convergence): [point][channel][light].
  std::vector<float> solve(const RayScene& scene, std::span<const V3f> lights, int bounces);

 private:
  struct Patch {
    int first = -1;  ///< index of its first point; -1: its corners are its points
    int parts = 1;   ///< per edge
  };
  /// The points of vertices and patches; empty: too many.
  std::vector<SurfacePoint> spread_points(const CellMesh& mesh);
  void place(const RayScene& scene, SurfacePoint point, bool back);
  bool has_backs() const { return albedo_.size() > fronts_; }
  /// The point on the other side. Precondition: has_backs().
  int behind(int point) const {
    const int fronts = static_cast<int>(fronts_);
    return point < fronts ? point + fronts : point - fronts;
  }
  void order_points(const RayScene& scene);
  void gather(const RayScene& scene, std::uint64_t seed);
  std::vector<float> solve_block(const RayScene& scene, std::span<const V3f> lights, int bounces);
  std::vector<float> light_directly(const RayScene& scene, std::span<const V3f> lights);

  std::vector<V3i> triangles_;
  std::vector<Patch> patches_;  ///< per triangle
  std::size_t fronts_ = 0;      ///< number of the first points, behind each of which there may be another
  std::vector<V3f> position_;
  std::vector<V3f> normal_;
  std::vector<V3f> albedo_;   ///< of light that goes back, gloss included
  std::vector<V3f> through_;  ///< of the light on the other side
  std::vector<int> order_;    ///< permutation of the points that keeps neighbours in space together
  // W in compressed rows.
  std::vector<std::size_t> row_start_;
  std::vector<int> column_;
  std::vector<float> weight_;
  std::uint64_t rays_ = 0;
};

}  // namespace selvedge
