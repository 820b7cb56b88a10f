// Replaces yarns of several plies by the plies as thinner yarns.
#pragma once

#include "converter/stitch/pattern.h"

namespace selvedge {

/// Radius of each of `plies` equal circles that touch each other in a ring within a circle of radius 1.
double ply_radius(int plies);

/// The pattern with each yarn of n > 1 plies replaced by n helices about its curve, as thick as the yarn
/// allows; yarns of one ply stay as they are. Helices follow a rotation-minimising frame; its rotation after
/// a repeat is spread over the whole length, and turns are rounded to 1/n, so that every ply continues in a
/// ply of the next repeat. Plies that change places between repeats form one chain over several repeats. The
/// fibres of a ply lean to it by fibre_degrees; hairs are shared out over the plies. Refuses (stitch_invalid)
/// plies beyond the limits of a pattern. Precondition: a valid pattern.
Result<StitchPattern> lay_plies(const StitchPattern& pattern, const std::string& file);

}  // namespace selvedge
