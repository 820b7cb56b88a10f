// Relaxes the drawing of a stitch to its shape: yarns tighten until they touch.
//
// A stitch is drawn with yarns that are too thin and too loose, but pass over and under each other correctly.
// Relaxation shortens and straightens every yarn while all grow to their full radius and push each other
// apart. A yarn that goes over another stays over it: yarns cannot pass through each other.
//
// Position-based dynamics (Müller et al. 2007) on polylines: implicit steps of each chain under tension and
// bending alternate with projections of the contacts between capsules, with steps that shrink to zero.
#pragma once

#include <functional>
#include <vector>

#include "converter/stitch/knit.h"
#include "format/base/progress.h"

namespace selvedge {

/// Maximum overlap of neighbouring yarns, in radii, that counts as touching.
constexpr double touching_overlap = 0.02;
/// Fraction of a knit's energy that its last steps may free at rest.
constexpr double max_rest_residual = 0.01;

struct RestedKnit;

struct RelaxOptions {
  double bending_length_radii = 3;  ///< stiffness: the length over which yarns bend, in radii
  double gap_radii = 0;          ///< between neighbouring yarns, in radii of the thicker one; 0: they touch
  double start_fraction = 0.13;  ///< fraction of its radius that a yarn begins with
  /// Maximum thickness of the cloth, in radii (half thicknesses) of the thickest yarn; 0: no limit. Without
  /// it, yarns with too little room beside each other climb onto each other.
  double max_thickness_radii = 0;
  /// Fraction of the displacement in the plane, across their direction, that each step takes back: 0 for
  /// knits, whose loops hold themselves; the yarns of a weave would wander without it (reed and beat hold
  /// them).
  double in_plane_restoring = 0;
  /// Whether yarns that have no room begin again, as thin as they had become (jammed, they may pass each
  /// other), and become thinner where they overlap at last.
  bool may_thin = false;
  int steps = 240;
  /// For hundreds of yarns: longer pieces, 60 steps, overlaps of up to 0.02 radii, and any thinner yarns that
  /// have room; equal crossings of a weave rest alike.
  bool is_rough = false;
  /// Parts of each yarn of a knit (draw_knit()), whose loops keep their lengths: rest_knit() does it then.
  /// And the size of a stitch of plain knit; the size that the repeat is blocked to, where 0 it is free.
  std::vector<std::vector<KnitPart>> parts{};
  V2d gauge_mm{0, 0};
  V2d blocked_mm{0, 0};
  /// Part of the way that a knit which is not blocked goes from the drawn size to its free one. Below 1 its
  /// wales do not lean.
  double free_part = 1;
  int stripes = 1;  ///< repeats of a knit that differ in colours alone, above each other
  /// A knit at rest of the same yarns, gauge and size of chart: where this one is drawn alike it stays as
  /// that one rests, but for some stitches around what differs.
  const RestedKnit* last = nullptr;
  Progress progress{};
};

struct RelaxResult {
  /// The same yarns, moved, their chains smooth and centred in z, with the given radii, or smaller ones if
  /// there is no room.
  StitchPattern pattern;
  double radius_fraction = 1;                  ///< fraction of the given radii
  bool has_settled = true;                     ///< whether the last try had room for most of its radii
  std::vector<std::vector<KnitPart>> parts{};  ///< of a knit
  V2d free_mm{0, 0};                           ///< of a knit: size of its repeat, left to itself
  double stretch = 0;                          ///< of a knit: of the yarn that is longest beside its loops
  int steps = 0;                               ///< of a knit
  double residual = 0;   ///< of a knit: fraction of the energy that the last steps freed, or one more would
  bool is_edit = false;  ///< stays as RelaxOptions::last, but for some stitches
  /// Lean of a knit: mm to the right a mm upwards by which repeats stand on the ones below them; left to
  /// itself, and as it is, so that `lean_repeats` of them end whole periods to the side (close_lean()).
  double free_lean = 0, lean = 0;
  int lean_repeats = 1;
};

/// A knit that has come to rest: its drawing, with the parts of that, and relax() of both.
struct RestedKnit {
  StitchPattern drawn;
  std::vector<std::vector<KnitPart>> parts{};
  RelaxResult relaxed;
};

/// Yarns of fibres (Yarn::fibre_kind) are soft: their sections flatten where they press each other, and
/// elsewhere along z by Yarn::flattening; the area is kept, and the result has squeezes. Tubes are rigid.
///
/// Neighbouring yarns of the result touch: if it `may_thin`, and is not rough, they overlap by less than
/// touching_overlap. Sections of flat yarns are apart in the direction in which there is most room.
/// Deterministic. Precondition: a valid pattern whose yarns, at `start_fraction` of their radius, are apart.
RelaxResult relax(const StitchPattern& pattern, const RelaxOptions& options = {});

/// relax() of a knit. Precondition: RelaxOptions::parts of draw_knit(), and its pattern.
RelaxResult rest_knit(const StitchPattern& drawn, const RelaxOptions& options);

using Relaxer = std::function<RelaxResult(const StitchPattern&, const RelaxOptions&)>;
/// relax(), or what a host has in its place: its memory of it, or a rougher one.
extern RelaxResult (*default_relaxer)(const StitchPattern& pattern, const RelaxOptions& options);

}  // namespace selvedge
