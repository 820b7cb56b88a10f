// Frames along a yarn's curve, which angles about it count from, and the plies of a yarn as thinner yarns.
#pragma once

#include <vector>

#include "converter/stitch/pattern.h"

namespace selvedge {

/// A place along a yarn with a unit vector across it.
struct YarnStation {
  V3d position;
  V3d tangent;
  V3d across;
  double arc_length = 0;  ///< from the start, mm
  V3d squeeze{0, 0, 0};   ///< of its section (format/fabric/yarn_section.h)
};

/// Frames that are carried along without rotation about the curve.
struct YarnFrames {
  std::vector<YarnStation> stations;  ///< the last one is where the next repeat begins
  double total_turn = 0;              ///< radians about the curve from the first frame to the last
};

/// Frames at most `step` mm apart. Precondition: a valid yarn.
YarnFrames frames_of(const Yarn& yarn, double step);

/// How a yarn's plies turn about it.
struct PlyTwist {
  YarnFrames frames;
  int ply_shift = 0;  ///< plies by which a ply moves on over a repeat
};
/// Precondition: a valid yarn of several plies.
PlyTwist ply_twist_of(const Yarn& yarn);

/// Changes of thickness and colour along a yarn: one every 12 radii.
int swells_of(double length, double radius_mm);

/// Seed of the noise of yarn or ply number `chain` of a pattern whose plies are laid.
int strand_seed(std::uint64_t seed, int chain);

/// Degrees by which the fibres of a ply lean to it, right-handed.
double fibre_angle_in_plies(const Yarn& yarn);

/// The pattern with each yarn of n > 1 plies replaced by n helices about its curve, as thick as the yarn
/// allows; yarns of one ply stay as they are. Helices follow a rotation-minimising frame; its rotation after
/// a repeat is spread over the whole length, and turns are rounded to 1/n, so that every ply continues in a
/// ply of the next repeat. Plies that change places between repeats form one chain over several repeats. The
/// fibres of a ply lean to it by fibre_degrees; hairs are shared out over the plies. Yarns that are
/// irregular get their thick and thin places, in which plies also lie further out. Refuses (stitch_invalid)
/// plies beyond the limits of a pattern. Precondition: a valid pattern.
Result<StitchPattern> lay_plies(const StitchPattern& pattern, const std::string& file);

}  // namespace selvedge
