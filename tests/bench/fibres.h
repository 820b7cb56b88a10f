// Explicit fibres, the truth that the surfaces of plies stand for (docs/yarn.md): their layout in the plies
// of a stitch, rays through an endlessly repeated cell of them, scattering by a fibre, and paths of light.
//
// Scattering: a rough dielectric cylinder with absorption inside. Chiang et al. 2016, "A Practical and
// Controllable Hair and Fur Model for Production Path Tracing", after d'Eon et al. 2011: light that the
// surface reflects (R), that passes through (TT), that is reflected inside once (TRT), and the rest. Energy
// is conserved: without absorption all light leaves again. Near field: the place across the fibre where a ray
// meets it counts. Scales (their tilt) are left out. The fraction of each kind of path follows the viewer's
// elevation alone, so a fibre is reciprocal between elevations of equal size, and nearly (6 %) between
// others.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "converter/light/path_tracer.h"
#include "converter/mesh/cell_mesh.h"
#include "converter/stitch/pattern.h"

namespace selvedge {

/// Round fibres as lines of points. Fibres of yarns end where they begin again, whole periods on; they may
/// leave the cell.
struct Fibres {
  V2d period{1, 1};           ///< mm
  std::vector<V3f> points;    ///< mm, fibre by fibre
  std::vector<int> first;     ///< first point of each fibre; then the number of points
  std::vector<float> radius;  ///< per fibre, mm
  std::vector<int> yarn;      ///< per fibre, index into yarns
  std::vector<Yarn> yarns;    ///< the plies, without their segments
  int count() const { return static_cast<int>(yarn.size()); }
};

/// The fibres of a stitch, and the hairs of `mesh`, which is made of it: `each_ply` in a ply, or (0) as many
/// as fill half of it by their diameter; other numbers are thicker or thinner. Fibres are spread evenly over
/// the section of each ply; they turn about it by its twist, sway against each other by about their distance,
/// and swell with it; they may run through each other. The same pattern gives the same fibres. Precondition:
/// a valid pattern.
Fibres lay_fibres(const StitchPattern& pattern, const CellMesh& mesh, int each_ply);

/// Optics of a fibre.
class HairOptics {
 public:
  /// `refraction`: the index. `along`, `around`: roughness in [0, 1] (beta_m, beta_n). `colour`: linear, of
  /// many such fibres; white fibres absorb nothing. The absorption follows by the paper's polynomial.
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

  /// f times the cosine, 1/sr: integrated over the sphere, the fraction of light that is not absorbed.
  V3d scattered(const HairDirection& light) const;
  /// Probability density of sample(), 1/sr.
  double density(const HairDirection& light) const;
  /// `random`, `more`: in [0, 1)^2.
  HairDirection sample(const V2d& random, const V2d& more) const;

 private:
  double turn_of(std::size_t path) const;
  template <class Value>
  Value sum(const HairDirection& light, const std::array<Value, 4>& fractions) const;

  const HairOptics& optics_;
  double sine_, cosine_;
  double out_, in_;  // angles of the ray to the normal, across the fibre: outside and inside
  std::array<V3d, 4> fraction_;
  std::array<double, 4> chance_;
};

/// Where a ray meets a fibre.
struct FibrePoint {
  V3d axis;           ///< the place on the fibre's axis, mm, in the cell
  V3d along;          ///< unit
  double radius = 0;  ///< mm
  double offset = 0;  ///< HairBsdf's
  V3d view;           ///< unit, towards the ray's origin
  int yarn = 0;       ///< index into Fibres::yarns
};

struct FibreSceneState;

/// Traces rays through an endlessly repeated cell of fibres, as RayScene does through triangles. Only
/// outsides of fibres are met: a ray that begins within one, as where fibres run through each other, leaves
/// it unseen.
class FibreScene {
 public:
  explicit FibreScene(const Fibres& fibres);
  ~FibreScene();

  V2d period() const;
  /// Highest z of the fibres, mm.
  double high() const;
  /// Finds the first fibre along the ray from `origin` (anywhere, mm) in unit `direction`; false without one.
  bool trace(const V3d& origin, const V3d& direction, FibrePoint& point) const;
  bool occluded(const V3d& origin, const V3d& direction) const;
  /// The origin of a ray that leaves a fibre: on the side that `direction` leads to.
  static V3d leave(const FibrePoint& point, const V3d& direction);

 private:
  std::unique_ptr<FibreSceneState> state_;
};

/// Paths of light through fibres, with next-event estimation: an unbiased estimate for any number of bounces.
/// It takes many: 31 for red and 85 for white wool to 95 % of the light.
class FibreTracer {
 public:
  /// `bounces` after the first fibre, or unlimited_bounces. Fibres have the refractive index and the
  /// longitudinal roughness of their kind, and absorb so that many of them have their yarn's albedo.
  FibreTracer(const FibreScene& scene, const std::vector<Yarn>& yarns, int bounces);

  /// A path's end outside of the cloth.
  struct Escape {
    V3d direction{0, 0, 0};
    V3d throughput{0, 0, 0};  ///< 0: it was absorbed
  };
  /// Traces a path from `point` and adds to radiance[l] the light that arrives from lights[l] of unit
  /// perpendicular irradiance, directly and indirectly. Adds to `rays`.
  Escape follow(const FibrePoint& point, std::span<const V3f> lights, PathSampler& sampler,
                std::span<V3d> radiance, std::uint64_t& rays) const;

 private:
  const FibreScene& scene_;
  std::vector<HairOptics> optics_;
  int bounces_;
};

}  // namespace selvedge
