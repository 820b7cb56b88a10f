// The reflectance of yarn (format/fabric/yarn_reflectance.h) at points that rays met, in packets, and as a
// distribution that directions are drawn from.
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

/// At a point that a ray met. The fibre is laid into the triangle's plane.
YarnSurface surface_at(const RayScene& scene, const SurfacePoint& point);

/// f in 1/sr; 0 where a direction lies below the surface.
V3d reflectance(const YarnSurface& surface, const V3d& light, const V3d& view);

/// The gloss alone, without its weight.
double gloss_reflectance(const YarnSurface& surface, const V3d& light, const V3d& view);

/// The gloss of up to 16 points, each for its view, under one light after another; in single precision.
class GlossPacket {
 public:
  void set(std::size_t lane, const YarnSurface& surface, const V3d& view);
  /// Weight times gloss_reflectance() of every lane; 0 where the light or the view lies below the surface.
  void reflectance(const V3f& light, std::array<float, packet_size>& result) const;

 private:
  using Lanes = std::array<float, packet_size>;
  // The fibre, the direction across and the normal, each over the lanes; the view in that frame.
  alignas(64) Lanes tx_{}, ty_{}, tz_{}, bx_{}, by_{}, bz_{}, nx_{}, ny_{}, nz_{};
  alignas(64) Lanes vx_{}, vy_{}, vz_{}, width_{}, seen_{}, weight_{};
};

/// A direction of light for a view: the mean of the weight times the light from there is the integral of
/// f(l, v) l.n times the light.
struct BsdfSample {
  V3d direction{0, 0, 1};
  V3d weight{0, 0, 0};
};
/// Nothing where a facet sends the light below the surface. `random`: in [0, 1)^2.
std::optional<BsdfSample> sample_bsdf(const YarnSurface& surface, const V3d& view, const V2d& random);

/// Cosine-distributed around `normal`; area preserving in `square`.
V3d cosine_direction(const V3d& normal, const V2d& square);

/// Share of uniform light that the gloss reflects, to 1e-3. In (0, 1].
double mean_gloss_albedo(float roughness);

/// Share of uniform light that yarn reflects at a point, gloss included: what indirect light is multiplied by
/// where it counts as reflected alike in all directions.
V3f albedo_with_gloss(const RayScene& scene, const SurfacePoint& point);

}  // namespace selvedge
