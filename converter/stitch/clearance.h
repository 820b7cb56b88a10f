// The least distance between the yarns of a stitch.
#pragma once

#include <string>

#include "converter/stitch/pattern.h"

namespace selvedge {

/// The minimum distance between yarn surfaces, mm: the distance of the centre lines minus both radii (of flat
/// yarn, of the sections in the direction in which there is most room), negative if yarns overlap, at most
/// the largest radius. Covers all pairs, copies in other cells included, except parts of one yarn less than
/// pi radii apart along it: a yarn bent no tighter than its own radius does not touch itself there (Schur's
/// comparison theorem). Sampled at points 1/16 radius apart along the yarns: too large by at most 1e-3 radii
/// where yarns cross. Refuses (mesh_invalid) yarns that are too many and too close. Precondition:
/// validate(pattern) holds.
Result<double> minimum_clearance(const StitchPattern& pattern, const std::string& file);

}  // namespace selvedge
