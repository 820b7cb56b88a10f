// A stitch pattern as data: the yarns of one repeating cell.
//
// Millimetres. Frame of the cell: x along growing u (the course of a knit, the weft of a weave), y up, z out
// of the cloth towards the viewer of its face. The pattern repeats with period_mm.x in x and period_mm.y in
// y; a yarn may leave the cell, as its copies fill the neighbouring cells.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "converter/mesh/cell_mesh.h"
#include "converter/stitch/bezier.h"
#include "format/base/error.h"
#include "format/base/vec.h"
#include "format/fabric/yarn_strands.h"

namespace selvedge {

/// A yarn. Its segments are a chain: each starts where the one before ends, and the last ends at the
/// start of the first plus whole periods (the yarn runs on into the next cell), or exactly there (a ring).
struct Yarn {
  std::string name{};
  double radius_mm = 0.5;        ///< of a round yarn with the same area
  V3f albedo{0.5F, 0.5F, 0.5F};  ///< linear, in [0, 1]
  std::vector<BezierSegment> segments{};
  Gloss gloss{};
  int plies = 1;  ///< number of plies twisted about each other, 1 to 8; 1: a round yarn
  /// Turns of the plies about the yarn, or of the fibres of a round yarn, per mm of its length: Z-twist (a
  /// right-handed screw) is positive, S-twist negative. Turns are rounded so that plies meet the plies of the
  /// next repeat.
  double twist_per_mm = 0;
  /// Its material: an index into yarn_kinds() (fibres.h); 0: a smooth tube.
  int fibre_kind = 0;
  /// Angle between the fibres at a ply's surface and the ply, 0 to 60, of the other hand than the twist.
  double fibre_degrees = 0;
  double hairiness = 0;   ///< mm of hair a mm of yarn, 0 to 100
  double hair_mm = 0;     ///< mean length of a hair; the longest is max_hair_length_ratio times as long
  double hair_loops = 0;  ///< fraction of hairs that return into the yarn, in [0, 1]
  double packing = 0.5;   ///< fraction of fibre in its section: weighs, and is not seen
  /// How much thickness and colour vary along the yarn, as root mean square of the change, 0 to 0.3.
  double irregularity = 0;
  /// How much the colours of its strands of fibres differ, as root mean square of the change, 0 to 0.4.
  double melange = static_cast<double>(default_contrast);
  double marl = 0;  ///< YarnStrands::marl
  /// Fraction of the diffuse light that goes through the wall of a ply rather than back, in [0, 1].
  double transmission = 0;
  /// Thickness over width of its section where it lies level, min_flattening to 1 (round).
  double flattening = 1;
  /// The squeeze (yarn_section.h) of its section, or of a ply's yarn's, where each segment starts; empty: by
  /// its flattening and course.
  std::vector<V3d> squeezes{};
  /// Its thick and thin places, as lay_plies() numbers them: of a ply, the places of its yarn, which it
  /// passes so many times. Without them it is as thick everywhere.
  YarnStrands swells{};
  int passes = 1;

  bool operator==(const Yarn&) const = default;
};

constexpr double max_seed = 4294967295.0;
constexpr double max_repeats = 16;

struct StitchPattern {
  std::string name;
  V2d period_mm{1, 1};
  std::vector<Yarn> yarns;
  std::uint32_t seed = 1;  ///< of fibres, hairs and irregularity

  bool operator==(const StitchPattern&) const = default;
};

/// Limits of a pattern, checked before any computation.
struct StitchLimits {
  int segments = 1 << 21;  ///< of all yarns together
  double min_mm = 1e-5;    ///< of radii and periods
  double max_mm = 1e7;
  double radius_periods = 2;  ///< radius as a multiple of the shorter period
  double reach_periods =
      64;  ///< how far a control point may lie from the origin, in periods of its axis (z: the longer)
};

/// Gap allowed between the end and the next start of a chain, in radii: allows for rounded decimals,
/// invisible.
constexpr double chain_tolerance = 1e-3;

/// Refuses patterns without yarns, yarns without segments, radii or periods out of their range, control
/// points that are not finite, albedo outside of [0, 1], gaps in a chain, hairs that are longer than the
/// shorter period, and exceeded limits; the place is a
/// JSON pointer ("/yarns/0/segments/3"). `file` is the file or stitch for the message.
Result<void> validate(const StitchPattern& pattern, const std::string& file, const StitchLimits& limits = {});

/// Whole periods from the start of the yarn's chain to its end; (0, 0): a ring. Precondition: a valid
/// pattern.
V2i chain_periods(const Yarn& yarn, const V2d& period_mm);

/// The cloth of a pattern whose repeats stand `lean` mm a mm to the right of the ones below them:
/// `lean_repeats` of them, which end whole periods to the side.
StitchPattern close_lean(const StitchPattern& pattern, double lean, int lean_repeats);

/// The same cloth with a period of `count` times as much each way: what varies by its seed along yarns and
/// between them repeats less often. A yarn that runs through one repeat runs through `count` of them, or
/// becomes several. Precondition: a valid pattern, count >= 1.
StitchPattern repeat_pattern(const StitchPattern& pattern, int count);

}  // namespace selvedge
