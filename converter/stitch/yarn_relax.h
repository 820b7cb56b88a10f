// Yarns that pull themselves tight until they touch: a drawing of a stitch -> its shape.
//
// A stitch is drawn with yarns that are too thin and lie too loose, over and under each other as they should.
// Relaxing lets every yarn shorten and straighten while all of them grow to their full radius and push each
// other apart. A yarn that goes over another stays over it: yarns cannot pass through each other.
//
// Position-based dynamics (Müller et al. 2007) on polylines: by turns an implicit step of each chain under
// tension and bending, and projections of the contacts between capsules, with the step going to zero.
#pragma once

#include "converter/stitch/pattern.h"

namespace selvedge {

struct RelaxOptions {
  double bending = 3;  ///< how stiff the yarns are: the length over which they bend, in radii
  double gap = 0;      ///< between neighbouring yarns, in radii of the thicker one; 0: they touch
  double start = 0.2;  ///< part of the radius that all yarns have at the beginning
  /// Most thickness of the cloth, in radii of the thickest yarn, as between two plates; 0: any. Without it
  /// yarns with too little room beside each other climb onto each other.
  double max_thickness = 0;
  /// Part of the way back to where they were drawn, across their course in the plane, that yarns go in each
  /// step: 0 in a knit, whose loops hold themselves; the yarns of a weave are held by reed and beat, or they
  /// wander.
  double hold = 0;
  int steps = 240;
  double segment_radii = 0.8;  ///< length of the Bézier segments that come out
};

struct Relaxed {
  /// The same yarns along the same way, moved, their chains smooth and centred in z; with radii as they were
  /// given, or as large a part of them as there is room for.
  StitchPattern pattern;
  double part = 1;  ///< of the given radii
};

/// Neighbouring yarns come out touching: they overlap by less than 1/50 of a radius. Precondition: a valid
/// pattern whose yarns, at `start` of their radius, do not overlap. The same pattern gives the same bits.
Relaxed relax(const StitchPattern& pattern, const RelaxOptions& options = {});

}  // namespace selvedge
