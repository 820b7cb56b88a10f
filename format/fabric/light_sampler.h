// Random lights for a view, for path tracers: sample(l | v), its density, and f over the density.
//
// The density is a mixture. Each lobe of each colour has a part proportional to cos^n about the direction in
// which it is largest (Lafortune et al. 1997), the diffuse term one in the cells of the stored lights where F
// depends on the light, else a cosine; the yarn itself has its gloss (normals that the viewer sees: Heitz
// 2018), a cosine about its normal and one for its indirect light. Parts are drawn by their estimated energy.
// A tenth is always a cosine about the normal of each texel that counts, without which f could be large where
// the density is not. What of a part lies on the other side of the cloth is mirrored in its plane.
#pragma once

#include <array>
#include <variant>
#include <vector>

#include "format/fabric/fabric.h"

namespace selvedge {

struct LightSample {
  V3f light{0, 0, 1};   ///< unit; below the plane of the cloth where light comes through
  float pdf = 0;        ///< 1/sr, of `light`; 0: nothing can be drawn, and nothing else is set but alpha
  V3f weight{0, 0, 0};  ///< f / pdf: its mean is the integral of f, which holds the cosine of the light
  float alpha = 0;      ///< opacity, not part of the weight
};

/// cos^exponent about a unit axis.
struct CosineLobe {
  V3d axis{0, 0, 1};
  double exponent = 1;
  V3d sample(const V2d& random) const;
  double pdf(const V3d& light) const;
};

/// Constant, or the cosine times a constant, in each cell of a grid of directions. The cells of the cosine
/// have equal fractions of it: the cells of the other grid, moved along meridians.
struct LightCells {
  DirectionGrid grid;
  bool is_cosine_weighted = true;
  std::vector<double> cumulative{};  ///< sums of the cells' fractions up to each; the last is 1
  /// In the square of directions, at a fraction of the cell's sides.
  V2d square_point(int cell, const V2d& within) const;
  V3d sample(const V2d& random) const;
  double pdf(const V3d& light) const;
};

/// A normal of the gloss's facets that the viewer sees (Heitz 2018, "Sampling the GGX Distribution of Visible
/// Normals"), of widths (roughness, 1). Unit, in the frame (fibre, across, normal); view.z > 0.
V3d sample_visible_normal(const V3d& view, double roughness, const V2d& random);

/// The gloss of yarn (yarn_reflectance.h), for half vectors that the viewer sees.
struct FibreGloss {
  std::array<V3d, 3> frame;  ///< fibre, across, normal
  V3d view{0, 0, 1};         ///< unit, in this frame; z > 0
  double roughness = 1;
  V3d sample(const V2d& random) const;
  double pdf(const V3d& light) const;
};

/// Samples lights for one point of the cloth seen from one side. Refers to the fabric.
class LightSampler {
 public:
  /// As evaluate() has them. From behind, the fabric is to be turned_over().
  LightSampler(const Fabric& fabric, double level, const V2d& uv, const V3f& view);

  /// `random`: in [0, 1). weight * pdf is what evaluate() returns.
  LightSample sample(const V3d& random) const;

  /// Density of sample() over solid angle, 1/sr, for unit lights on both sides of the cloth. It is positive
  /// wherever f is, and its integral is 1, unless it is 0 everywhere: for view.z <= 0, where a ray meets no
  /// yarn, and where both levels that are blended have alpha = 0.
  float pdf(const V3f& light) const;

 private:
  struct Part {
    double fraction = 0;
    std::variant<CosineLobe, LightCells, FibreGloss> shape;
  };
  /// Lights above the cloth, and below it, mirrored.
  enum Half { above, below };
  struct Floor {
    Half half;
    V3d axis;
    double weight;
  };

  template <class Shape>
  void add(Half half, double energy, Shape shape);
  void add_texel(const FabricLevel& level, const FabricInfo& info, Half half, double weight);
  void add_yarn(const Yarns& yarns, double weight);
  void add_point(int level, double weight);

  const Fabric& fabric_;
  double level_;
  V2d coordinates_;
  V2d uv_;  ///< displaced_place() them
  V3f view_;
  std::array<std::vector<Part>, 2> parts_;
  std::vector<Floor> floors_;
};

}  // namespace selvedge
