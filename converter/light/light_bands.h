// Light of large cloth, a band of rows at a time, in the memory of one band.
#pragma once

#include "converter/light/line_light.h"

namespace selvedge {

/// As compute_yarn_light(), but yarn that runs along rows and has more stations of plies than these is lit in
/// bands of rows, each with 12 radii of its neighbours above and below as a cloth of its own.
bool compute_light_in_bands(YarnData& data, const V2f& period, std::span<const V3f> through,
                            const LineLightOptions& options, int max_ply_stations = 1 << 15);

}  // namespace selvedge
