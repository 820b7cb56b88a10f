// Hairs that stand off yarn (spec/brdf.md, "Hairs"): one formula for the bake, which gives them to its mesh,
// and for level -1 of a fabric.
#pragma once

#include <array>
#include <cstdint>

#include "format/base/vec.h"

namespace selvedge {

/// The hairs of a curve in a file; they follow from its strands' seed.
struct YarnHairs {
  /// Over the chain and all plies. Negative: of yarn turned over, mirrored ones.
  int count = 0;
  float mean_length =
      0;  ///< mm, mean of an exponential distribution, which is cut at max_hair_length_ratio times that
  float loop_fraction = 0;  ///< fraction of hairs that return into the yarn
  float radius = 0;         ///< mm
  float opacity = 1;        ///< fraction of light on a hair that it stops: level -1 draws it as much thinner
  bool operator==(const YarnHairs&) const = default;
};

inline constexpr int max_hairs = 100000;  ///< of a curve
/// Lengths of hairs are exponential up to this multiple of their mean.
inline constexpr double max_hair_length_ratio = 3;
inline constexpr int hair_point_count = 8;
/// The largest radius that a hair takes for others that are not drawn, in radii of the yarn.
inline constexpr float max_hair_radius_ratio = 1.0F / 8;

struct YarnHair {
  std::array<V3d, hair_point_count> points;  ///< mm, the first at the surface
  V3d normal{0, 0, 1};                       ///< of the yarn or ply at its root, unit
  float station = 0;                         ///< of its root
  V3f root_angle{1, 0, 0};  ///< cosine and sine of the root's angle about the axis, and outward
  V2f ply_side{0, 0};       ///< YarnPoint::ply_side of its root
};

/// Points of a hair as seen from its root: x along the fibres there, y across them, z out of the yarn.
/// `hashed_seed`: hash32() of the seed.
std::array<V3d, hair_point_count> hair_points(const YarnHairs& hairs, std::uint32_t hashed_seed, int hair);

}  // namespace selvedge
