// Light along paths, without approximation: each path is one sample of the integral over all paths, with the
// light of every vertex added (next-event estimates). The mean over paths is right for any number of bounces.
#pragma once

#include <optional>
#include <span>

#include "converter/light/sobol.h"
#include "converter/light/yarn_brdf.h"

namespace selvedge {

/// As a number of bounces: until Russian roulette ends the path.
inline constexpr int unlimited_bounces = -1;

class PathTracer {
 public:
  /// `bounces`: diffuse or glossy reflections after the first surface, 0 to 64 or unlimited_bounces. From the
  /// fourth on, Russian roulette ends dark paths and makes up for them: the mean does not change.
  PathTracer(const RayScene& scene, int bounces) : scene_(scene), bounces_(bounces) {}

  /// Adds to radiance[l], for a path that begins at `point` seen from unit direction `view`, what reaches the
  /// eye after one reflection or more, under unit perpendicular irradiance from lights[l]. Gives back the
  /// number of rays.
  std::uint64_t add_indirect(const SurfacePoint& point, const V3d& view, std::span<const V3f> lights,
                             PathSampler& sampler, std::span<V3d> radiance) const;

  /// Continues a path after `depth` reflections from `at`, seen from `view`: multiplies its throughput and
  /// gives the direction; nothing where the path ends.
  std::optional<V3d> reflect(const SurfacePoint& at, const V3d& view, int depth, PathSampler& sampler,
                             V3d& throughput) const;

 private:
  const RayScene& scene_;
  int bounces_;
};

}  // namespace selvedge
