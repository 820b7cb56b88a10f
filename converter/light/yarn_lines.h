// Global lines through the yarn of a repeating cell (Sbert 1993, "An integral geometry based method for fast
// form-factor computation"): what faces what, without mesh and rays.
//
// Parallel lines on a grid cross all plies and hairs. Of each line the sorted intervals within yarn are
// known, so also the sequence of surfaces: two that follow each other face each other, across open air or
// across the inside of a ply. Lines pass a surface in the measure of its cosine, so that counts of them are
// form factors, and those that meet nothing before a surface are its light from the sky.
#pragma once

#include <span>
#include <vector>

#include "format/fabric/yarns.h"

namespace selvedge {

/// The surfaces of a cell in patches, numbered: outsides of plies (fronts) by curve, part of a station, ply
/// and angle; hairs by curve and station; the insides of plies.
class YarnPatches {
 public:
  static constexpr int fronts_per_inside = 2;  ///< fronts that share their inside, where light is even

  /// `parts`: of a station; `around`: fronts about a ply, an even number. `yarns` must outlive the object.
  YarnPatches(const Yarns& yarns, int parts, int around);

  int parts_per_station() const { return parts_; }
  int fronts_around_ply() const { return around_; }
  int front_patch_count() const { return fronts_; }
  int first_hair_patch() const { return fronts_; }
  int first_inside_patch() const { return first_hair_patch() + hairs_; }
  int count() const { return first_inside_patch() + fronts_ / fronts_per_inside; }
  int inside_patch(int front) const { return first_inside_patch() + front / fronts_per_inside; }
  /// Precondition: the curve has the part and the ply.
  int front_patch(int curve, int part, int ply, int angle) const {
    return first_front_[curve] + (part * yarns_.data().curves[curve].plies.count + ply) * around_ + angle;
  }
  /// `piece`: of Yarns::Geometry, and no hair; `angle`: about its ply.
  int front_patch(int piece, float station, float angle) const;
  int hair_patch(int piece) const { return hair_[piece]; }
  /// The curve of a patch.
  int curve_of(int patch) const;

 private:
  const Yarns& yarns_;
  int parts_, around_;
  int fronts_ = 0, hairs_ = 0;
  std::vector<int> first_front_, first_hair_;  ///< of each curve
  std::vector<int> ply_, hair_;                ///< of each piece
};

/// Where a line meets a patch.
struct PatchFace {
  std::int32_t patch = -1;  ///< -1: the sky
  float fibre_cosine = 0;   ///< component along the fibre of the line's way out
};

/// Surfaces that the lines of one direction meet.
struct LineCrossings {
  struct Link {
    PatchFace upper, lower;
  };
  std::vector<Link> open_air_links;                       ///< that face each other across open air
  std::vector<std::array<std::int32_t, 2>> inside_links;  ///< patches that do so inside of a ply
  std::vector<PatchFace> sky_above, sky_below;            ///< that the sky is seen from, above and below
  float area = 0;                                         ///< of a line, across it, mm^2
};

/// Memory that trace_lines() reuses.
struct LineScratch {
  /// Where a line is within a piece.
  struct Interval {
    float top, bottom;  ///< heights, mm
    std::int32_t piece;
    std::int32_t line;
  };
  std::vector<Interval> found_intervals, sorted_intervals;
  std::size_t interval_count = 0;  ///< of the intervals that are found
  std::vector<std::size_t> line_begins, line_cursors;
  LineCrossings crossings;
};

/// Follows all lines of unit `direction`, z > 0, `spacing` mm apart, through the `pieces`. `index` shifts the
/// lattices of several directions against each other.
LineCrossings trace_lines(const Yarns& yarns, const YarnPatches& patches,
                          std::span<const std::int32_t> pieces, const V3f& direction, float spacing,
                          int index, LineScratch& scratch);

}  // namespace selvedge
