// Yarn's surface and what it reflects at many hits at once: the fast twin of Yarns::point_at(), transfer_at()
// and direct(), held to them by a test.
#pragma once

#include "format/fabric/yarns.h"

namespace selvedge {

struct YarnSurface {
  using Floats = std::array<float, yarn_lanes>;
  using Factors = std::array<Floats, 3 * light_functions_of_yarn>;  ///< [function][colour]
  YarnLanes normal;                                                 ///< of the strand that is seen
  YarnLanes fibre;
  YarnLanes leave;                      ///< where light leaves it; mm, of any repeat
  alignas(64) Floats cosine{}, sine{};  ///< of the angle about the axis
  alignas(64) Floats outward{};         ///< YarnPoint::outward
  alignas(64) Floats gloss{}, roughness{};
  YarnLanes matt;  ///< f of the yarn without its gloss, 1/sr
  bool has_gloss = false;
  alignas(64) Factors transfer{};  ///< of the functions of a light
  alignas(64) Factors through{};   ///< of a light from below, mirrored; undefined if unknown
  alignas(64) Factors sky{};       ///< of smooth light from all around (yarn_sky.h)
};

/// The surface at the hits of `lanes`; of other lanes it is undefined. At least one lane. `sky`: of the
/// yarn, or empty where it is not wanted. `spacing`: width of what a point stands for, mm;
/// strands much thinner than that are not seen apart.
void find_surface(const Yarns& yarns, std::span<const float> sky, const YarnHits& hits, std::uint32_t lanes,
                  const YarnLanes& view, const YarnSurface::Floats& spacing, YarnSurface& surface);

/// f of one light, 1/sr.
struct YarnReflection {
  YarnLanes indirect;        ///< by way of other yarn
  YarnLanes direct;          ///< whether or not yarn hides the light
  std::uint32_t facing = 0;  ///< lanes in which that is not 0
};

/// Directions are unit; where the light is not above the horizon, the result is undefined.
void reflect(const YarnSurface& surface, const YarnLanes& light, const YarnLanes& view,
             YarnReflection& result);

/// f of one light from below, which is given mirrored.
void reflect_through(const YarnSurface& surface, const YarnLanes& light, YarnLanes& result);

}  // namespace selvedge
