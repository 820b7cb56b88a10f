// Path tracer with next-event estimation: an unbiased estimate for any number of bounces.
#pragma once

#include <optional>
#include <span>

#include "converter/light/sobol.h"
#include "converter/light/yarn_brdf.h"

namespace selvedge {

/// Number of bounces that leaves the end of the path to Russian roulette.
inline constexpr int unlimited_bounces = -1;

class PathTracer {
 public:
  /// `bounces`: diffuse or glossy reflections after the first surface, 0 to 64 or unlimited_bounces. From the
  /// fourth on, Russian roulette ends dark paths without changing the mean.
  PathTracer(const RayScene& scene, int bounces) : scene_(scene), bounces_(bounces) {}

  /// Traces a path from `point`, seen from unit direction `view`, and adds to radiance[l] the light that
  /// arrives after at least one further reflection, under unit perpendicular irradiance from lights[l].
  /// Returns the number of rays.
  std::uint64_t add_indirect(const SurfacePoint& point, const V3d& view, std::span<const V3f> lights,
                             PathSampler& sampler, std::span<V3d> radiance) const;

  /// Continues a path after `depth` reflections from `point`, seen from `view`: multiplies `throughput` and
  /// returns the next direction, perhaps through the wall, or nothing if the path ends.
  std::optional<V3d> reflect(const SurfacePoint& point, const V3d& view, int depth, PathSampler& sampler,
                             V3d& throughput) const;

 private:
  const RayScene& scene_;
  int bounces_;
};

}  // namespace selvedge
