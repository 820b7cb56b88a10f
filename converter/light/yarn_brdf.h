// BRDF of yarn (format/fabric/yarn_reflectance.h) at points that rays meet, in packets, and importance
// sampling of it.
#pragma once

#include <optional>

#include "converter/light/ray_scene.h"

namespace selvedge {

/// All directions are unit and point away from the surface.
struct YarnSurface {
  V3d normal{0, 0, 1};
  V3d albedo{0, 0, 0};
  V3d fibre{1, 0, 0};  ///< unit, in the plane of the surface
  Gloss gloss;
};

/// The surface at a point, with the fibre projected to the triangle's plane, and the strand of fibres that is
/// met there (fibre_noise.h).
YarnSurface surface_at(const RayScene& scene, const SurfacePoint& point);

/// f in 1/sr; 0 if a direction lies below the surface.
V3d reflectance(const YarnSurface& surface, const V3d& light, const V3d& view);

/// The gloss term of f without its weight w.
double gloss_reflectance(const YarnSurface& surface, const V3d& light, const V3d& view);

/// The gloss of up to 16 points, each with its own view, for one light at a time; in single precision.
class GlossPacket {
 public:
  void set(std::size_t lane, const YarnSurface& surface, const V3d& view);
  /// The weight times gloss_reflectance() of every lane; 0 if light or view lies below the surface.
  void reflectance(const V3f& light, std::array<float, packet_size>& result) const;

 private:
  using Lanes = std::array<float, packet_size>;
  // The fibre, the direction across and the normal, each over the lanes; the view in that frame.
  alignas(64) Lanes tx_{}, ty_{}, tz_{}, bx_{}, by_{}, bz_{}, nx_{}, ny_{}, nz_{};
  alignas(64) Lanes vx_{}, vy_{}, vz_{}, width_{}, seen_{}, weight_{};
};

/// A sampled direction of light: the mean of `weight` times the radiance from there is the integral of f(l,
/// v) l.n times radiance.
struct BsdfSample {
  V3d direction{0, 0, 1};
  V3d weight{0, 0, 0};
};
/// Nothing if a facet reflects below the surface. `random` lies in [0, 1)^2.
std::optional<BsdfSample> sample_bsdf(const YarnSurface& surface, const V3d& view, const V2d& random);

/// A cosine-distributed direction around `normal`; area preserving in `square`, which lies in [0, 1)^2.
V3d cosine_direction(const V3d& normal, const V2d& square);

/// Share of uniform light that the gloss reflects, in (0, 1]; accurate to 1e-3.
double mean_gloss_albedo(float roughness);

/// Share of uniform light that yarn reflects at a point, gloss included: the albedo for indirect light that
/// counts as reflected equally in all directions.
V3f albedo_with_gloss(const RayScene& scene, const SurfacePoint& point);

}  // namespace selvedge
