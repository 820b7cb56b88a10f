// Yarns of several plies -> the plies themselves, as thinner yarns.
#pragma once

#include "converter/stitch/pattern.h"

namespace selvedge {

/// Radius of each of `plies` equal circles that touch each other in a ring within a circle of radius 1.
double ply_radius(int plies);

/// The same pattern with each yarn of n > 1 plies replaced by n helices about its curve, as thick as fits
/// into the yarn; yarns of one ply stay as they are. The helices start from a frame that is carried along the
/// curve without turning about it; what that frame is turned by after a repeat is spread over the whole
/// length, and the turns are rounded to 1/n, so that every ply runs on into a ply of the next repeat. Plies
/// that change places from one repeat to the next are one chain over several repeats. A ply has no twist of
/// its own: its fibres run along it. Refuses (stitch_invalid) plies that are too many or too long for the
/// limits. Precondition: a valid pattern.
Result<StitchPattern> lay_plies(const StitchPattern& pattern, const std::string& file);

}  // namespace selvedge
