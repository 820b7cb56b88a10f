// Scattering of light by a fibre: a rough dielectric cylinder with absorption inside. Chiang et al. 2016, "A
// Practical and Controllable Hair and Fur Model for Production Path Tracing", after d'Eon et al. 2011: light
// that the surface reflects (R), that passes through (TT), that is reflected inside once (TRT), and what is
// left. Energy is conserved: without absorption all light leaves again.
//
// Near field: it depends on where across the fibre a ray meets it. Scales (their tilt) are left out. The
// share of each kind of path follows the viewer's elevation alone; between elevations of equal size the
// fibre as a whole is reciprocal, between others nearly (hair_bsdf_test.cpp).
#pragma once

#include <array>

#include "format/base/vec.h"

namespace selvedge {

/// What a fibre is made of.
class HairOptics {
 public:
  /// `refraction`: the index. `along`, `around`: roughness in [0, 1] (beta_m, beta_n). `colour`: linear, that
  /// of many such fibres; white fibres absorb nothing. The absorption follows by the paper's polynomial.
  HairOptics(double refraction, double along, double around, const V3d& colour);

 private:
  friend class HairBsdf;
  double refraction_;
  std::array<double, 4> spread_;  // longitudinal variance of each kind of path
  double scale_;                  // of the azimuthal logistic distribution
  V3d absorption_;                // per radius
};

/// The roughness along a fibre (beta_m) whose lobe has this width, in radians.
double hair_roughness(double width);

/// Light in the plane across the fibre: elevations are angles to this plane, azimuths count from the
/// viewer's.
struct HairDirection {
  double sine = 0;  ///< of the elevation
  double azimuth = 0;
};

/// A fibre where a ray meets it.
class HairBsdf {
 public:
  /// `view_sine`: of the viewer's elevation. `offset`: of the ray from the axis, in radii, in [-1, 1];
  /// negative where the surface's normal has a positive azimuth.
  HairBsdf(const HairOptics& optics, double view_sine, double offset);

  /// f times the cosine, 1/sr: integrated over the sphere, the share of light that is not absorbed.
  V3d scattered(const HairDirection& light) const;
  /// Probability density of sample(), 1/sr.
  double density(const HairDirection& light) const;
  /// `random`, `more`: in [0, 1)^2.
  HairDirection sample(const V2d& random, const V2d& more) const;

 private:
  double turn_of(std::size_t path) const;
  template <class Value>
  Value sum(const HairDirection& light, const std::array<Value, 4>& shares) const;

  const HairOptics& optics_;
  double sine_, cosine_;
  double out_, in_;  // angles of the ray to the normal, across the fibre: outside and inside
  std::array<V3d, 4> share_;
  std::array<double, 4> chance_;
};

}  // namespace selvedge
