// Reflection of smooth light from all around by yarn (smooth_light.h, brdf.md "Environments").
#pragma once

#include <functional>
#include <vector>

#include "format/fabric/smooth_light.h"
#include "format/fabric/yarns.h"

namespace selvedge {

/// Fraction of a direction's light that reaches the surface of the yarn at a point.
using LightAtPoint = std::function<float(const StationPoint& point)>;
/// Casts the light of a unit direction.
using LightCaster = std::function<LightAtPoint(const V3f& light)>;

/// For the yarn's stations and angles, factors of the functions of the light:
/// radiance = sum over i, k of c_ik A_i(angle) L_k, L in the fabric's axes; laid out as
/// YarnData::station_light. Direct light with what yarn hides of it, that by way of other yarn, and what
/// comes through from below. Gloss reflects its mean, whatever the view. `cast` is called for some directions
/// by several threads; without it, rays are traced from points at the stations: milliseconds a stitch.
std::vector<float> sky_transfer(const Yarns& yarns, const LightCaster& cast = {});

static_assert(smooth_function_count == yarn_light_function_count);

}  // namespace selvedge
