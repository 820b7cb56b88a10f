// Path tracer with next-event estimation: an unbiased estimate for any number of bounces; and its random
// numbers.
//
// Low-discrepancy points: the first two dimensions of Sobol's sequence under Owen scrambling, hashed as by
// Laine and Karras 2011 in the form of Burley 2020 ("Practical Hash-based Owen Scrambling", JCGT 9(4)). The
// first 2^k points have one point in each elementary interval of area 2^-k, so the error of a mean falls
// faster than with independent points; each single point is uniform, so the mean is unbiased.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "converter/light/yarn_brdf.h"
#include "format/base/random.h"

namespace selvedge {

/// Point `index` of the sequence scrambled by `seed`, in [0, 1)^2.
V2d sobol_point(std::uint32_t index, std::uint64_t seed);

/// Random numbers of one path in pairs. The first `spread_pairs` are low-discrepancy over the paths of one
/// seed (each pair in an order of its own), later ones are independent.
class PathSampler {
 public:
  PathSampler(std::uint32_t index, std::uint64_t seed) : index_(index), seed_(seed), random_(seed, index) {}
  V2d next_pair();

 private:
  static constexpr std::uint64_t spread_pairs = 4;
  std::uint32_t index_;
  std::uint64_t seed_;
  std::uint64_t pair_ = 0;
  Random random_;
};

/// Number of bounces that leaves the end of the path to Russian roulette.
inline constexpr int unlimited_bounces = -1;

class PathTracer {
 public:
  /// `bounces`: diffuse or glossy reflections after the first surface, 0 to 64 or unlimited_bounces. From the
  /// fourth on, Russian roulette ends dark paths without changing the mean.
  PathTracer(const RayScene& scene, int bounces) : scene_(scene), bounces_(bounces) {}

  /// Traces a path from `point`, seen from unit direction `view`, and adds to radiance[l] the light that
  /// arrives after at least one further reflection, under unit perpendicular irradiance from lights[l].
  void add_indirect(const SurfacePoint& point, const V3d& view, std::span<const V3f> lights,
                    PathSampler& sampler, std::span<V3d> radiance) const;

  /// Continues a path after `depth` reflections from `point`, seen from `view`: multiplies `throughput` and
  /// returns the next direction, perhaps through the wall, or nothing if the path ends.
  std::optional<V3d> continue_path(const SurfacePoint& point, const V3d& view, int depth,
                                   PathSampler& sampler, V3d& throughput) const;

  /// Moves `point` to where light goes from it; false: to nothing. Within translucent yarn it passes the
  /// walls of other yarn, up to where it is outside all.
  bool follow(const V3d& direction, SurfacePoint& point) const;

 private:
  const RayScene& scene_;
  int bounces_;
};

}  // namespace selvedge
