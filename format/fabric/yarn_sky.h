// Reflection of smooth light from all around by yarn (smooth_light.h, brdf.md "Environments").
#pragma once

#include <vector>

#include "format/fabric/smooth_light.h"
#include "format/fabric/yarns.h"

namespace selvedge {

/// For the yarn's stations and angles, factors of the functions of the light:
/// radiance = sum over i, k of c_ik A_i(angle) L_k, L in the fabric's axes; laid out as
/// YarnData::station_light. Direct light with what yarn hides of it, that by way of other yarn, and what
/// comes through from below. Gloss reflects its mean, whatever the view. Traced from points at the stations:
/// milliseconds.
std::vector<float> sky_transfer(const Yarns& yarns);

static_assert(smooth_function_count == yarn_light_function_count);

}  // namespace selvedge
