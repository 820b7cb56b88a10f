// BRDF of yarn (format/fabric/yarn_reflectance.h) at points that rays meet, and importance sampling
// of it.
//
// The wall of a yarn or ply may let light through: of the diffuse part, the fraction `transmission` leaves on
// the other side, Lambertian on both sides. A ply is then a hollow tube, and light crosses it by two walls
// and bounces between them (cf. Montazeri et al. 2020, "A practical ply-based appearance model of woven
// fabrics": plies as surfaces that reflect and transmit). Inside there is no highlight. Only surfaces
// scatter, so energy and reciprocity hold whatever the geometry.
//
// The surface of a yarn or ply is covered with strands of fibres, as seeded noise without geometry: they lie
// side by side and follow the fibres' lay. Each strand is a little round, and over lengths of a few radii it
// differs in height, lean, direction and colour from its neighbours. Their mean colour is the yarn's.
#pragma once

#include <optional>

#include "converter/light/ray_scene.h"

namespace selvedge {

/// All directions are unit and point away from the surface.
struct YarnBrdf {
  V3d normal{0, 0, 1};
  V3d albedo{0, 0, 0};           ///< of the wall (wall_albedo.h)
  V3d fibre_direction{1, 0, 0};  ///< unit, in the plane of the surface
  Gloss gloss;
  double transmission = 0;  ///< fraction of the diffuse part that goes through the wall, in [0, 1]
  V3d inward{0, 0, -1};     ///< unit, of the triangle, away from the viewer: the side that it goes to
  /// Factor on the diffuse light that leaves: of the strand, where light crosses many of them. About 1.
  double diffuse_factor = 1;
};

/// The surface at a point, with the fibre projected to the triangle's plane, and the strand of fibres that is
/// met there (yarn_strands.h).
YarnBrdf brdf_at(const RayScene& scene, const SurfacePoint& point);

/// Fraction of the light that is not in the highlight: 1 - w. In translucent yarn also the light that the
/// highlight's facets block, on average: there light goes on where it would be lost.
double diffuse_weight(const YarnBrdf& surface);

/// Cosine of the light's incidence, on the side that it comes from; 0 where it lies below both.
double incidence_cosine(const YarnBrdf& surface, const V3d& light);

/// f in 1/sr, also of light that comes through; 0 if a direction lies below the surface.
V3d reflectance(const YarnBrdf& surface, const V3d& light, const V3d& view);

/// A sampled direction of light: the mean of `weight` times the radiance from there is the integral of f(l,
/// v) l.n times radiance.
struct BsdfSample {
  V3d direction{0, 0, 1};
  V3d weight{0, 0, 0};
};
/// Nothing if a facet reflects below the surface. `random` lies in [0, 1)^2.
std::optional<BsdfSample> sample_bsdf(const YarnBrdf& surface, const V3d& view, const V2d& random);

/// A cosine-distributed direction around `normal`; area preserving in `square`, which lies in [0, 1)^2.
V3d cosine_direction(const V3d& normal, const V2d& square);

/// Light straight from a lamp of unit perpendicular irradiance that leaves a point towards `view`, where the
/// lamp is not hidden.
V3d direct_light(const RayScene& scene, const SurfacePoint& point, const YarnBrdf& surface, const V3f& light,
                 const V3d& view);

}  // namespace selvedge
