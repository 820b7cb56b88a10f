// Light of edited cloth: anew near the change, elsewhere what it was.
#pragma once

#include "converter/light/line_light.h"

namespace selvedge {

/// compute_yarn_light() of yarn that lies as `last` but in some places: lines follow only what is within two
/// stitches or so of these, and stations farther than one from them keep their light. False, without light,
/// where the period is another or most of the yarn lies elsewhere. Precondition: `last` has light, from both
/// sides if that is wanted. `stitch`: size, mm, of one for a preview, where lines follow only yarn of which
/// none lies alike: other yarn that lies elsewhere takes the light of the one that lies most alike, stitches
/// away.
bool relight_near_changes(YarnData& data, const V2f& period, std::span<const V3f> through, const Yarns& last,
                          LineLightOptions options, const V2f& stitch = V2f(0));

}  // namespace selvedge
