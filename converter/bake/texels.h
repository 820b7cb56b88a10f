// Traces rays through the texels of one view and sums the radiance under a set of lights.
#pragma once

#include <cmath>
#include <span>

#include "converter/light/path_tracer.h"
#include "format/samples/samples.h"

namespace selvedge {

/// Noise of sample means, summed over texels, lights and channels: `error2` estimates the squared error of
/// opacity * radiance, `signal2` is its square. The estimate is an upper one for a single low-discrepancy
/// set, whose halves differ by more than independent sets.
struct NoiseSum {
  double squared_error = 0;
  double squared_signal = 0;
  /// Root mean square error relative to the signal's root mean square; 0 without a signal.
  double relative_error() const { return squared_signal > 0 ? std::sqrt(squared_error / squared_signal) : 0; }
  NoiseSum& operator+=(const NoiseSum& other) {
    squared_error += other.squared_error;
    squared_signal += other.squared_signal;
    return *this;
  }
};

class TexelBaker {
 public:
  /// Texels lie at height `plane_z` (mm above the lowest point).
  TexelBaker(const RayScene& scene, int bounces, const V2i& texels, double plane_z)
      : scene_(scene), tracer_(scene, bounces), texels_(texels), plane_z_(plane_z) {}

  /// Samples of all texels from one view with `samples` rays each. Every view needs a seed of its own.
  ViewSamples bake_view(const V3f& view, std::span<const V3f> lights, int samples, std::uint64_t seed,
                        NoiseSum& noise) const;

  /// Samples of one pair from two independent halves of `samples` rays.
  PairSamples bake_pair(const DirectionPair& pair, int samples, std::uint64_t seed, NoiseSum& noise) const;

 private:
  struct Gather;
  /// Rays `first` to `end` of a texel.
  Gather sample(const V2i& texel, std::uint32_t first, std::uint32_t end, std::uint64_t seed, const V3f& view,
                std::span<const V3f> lights) const;

  const RayScene& scene_;
  PathTracer tracer_;
  V2i texels_;
  double plane_z_;
};

}  // namespace selvedge
