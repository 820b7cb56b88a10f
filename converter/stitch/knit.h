// Draws knitting charts as patterns: yarns whose loops are drawn through each other.
#pragma once

#include <string>
#include <vector>

#include "converter/stitch/pattern.h"

namespace selvedge {

/// One stitch, as seen from the face: the loop that stands in this place of its course, and what it is drawn
/// through.
struct ChartStitch {
  bool purl = false;  ///< drawn through from the front to the back, not from the back to the front
  /// Columns, counted from its own, of the loops of the course below that it is drawn through: one; none of a
  /// yarn over; two or three of a decrease, from the one in front to the one behind.
  std::vector<int> source_loops{0};
  int cable_layer = 0;   ///< of a cable: its loop crosses in front of the others (1) or behind them (-1)
  std::size_t yarn = 0;  ///< that it is knitted with
  /// 1: a loop is turned, its right leg over its left one; -1: the left one over the right one. It is the
  /// loop that this stitch is drawn through, or its own, where it is drawn through none.
  int twist = 0;
  /// Not knitted: the loop below stays for the stitch above. The yarn passes behind it or in front of it, or
  /// lies over it as a loop of its own, and both are knitted as one.
  enum class Held { none, yarn_behind, yarn_in_front, tuck } held = Held::none;

  bool operator==(const ChartStitch&) const = default;
};

/// One repeat of a knit. Each loop is held by one stitch of the course above (of the first course above the
/// last); the columns of a row go round.
struct KnitChart {
  std::vector<std::vector<ChartStitch>> rows;  ///< from the bottom upwards, all of one length, left to right
  double wale_mm = 5;                          ///< width of one stitch
  double course_mm = 3.8;                      ///< height of one course
  bool blocked = false;     ///< the cloth is stretched to these; else they are plain knit's
  std::vector<Yarn> yarns;  ///< without segments
  /// Stitches that a yarn may pass behind the cloth; a longer float is caught behind a stitch. 0: none is.
  int max_float = 0;
};

/// Fraction of the drawing's height that loops may take to move to other columns; with less left, the other
/// parts of the courses would come too close to each other.
constexpr double max_crossing_fraction = 0.6;

/// Courses that a loop can be slipped.
constexpr int max_slipped = 6;

/// Height, in courses, that the loops below this row take in the drawing to move to other columns: 0 where
/// none does. Precondition as of draw_knit().
double crossing_courses(const KnitChart& chart, int row);

/// A part of a chain: a loop from foot to foot, or a float behind a stitch of another yarn.
struct KnitPart {
  bool is_loop = true;
  double length_mm = 0;      ///< of yarn, by the table in spec/chart.md
  std::size_t segments = 0;  ///< of the drawing
  bool begins_row = true;    ///< whether its yarn is the first one of its row
  bool operator==(const KnitPart&) const = default;
};

/// Length of the loop of a knit stitch in plain knit of this gauge, mm (Knapton et al. 1968: 23.1 in fully
/// relaxed cloth of any yarn, as the root of the area of a stitch, squared).
double length_of_knit(double wale_mm, double course_mm);

struct DrawnKnit {
  StitchPattern pattern;
  std::vector<std::vector<KnitPart>> parts{};  ///< of each yarn, in their order
};

/// The yarns of the chart, with radii at which they do not touch (RelaxOptions::start_fraction). Each course
/// has one chain for every yarn that it is knitted with; a yarn passes stitches of other yarns behind the
/// cloth. Precondition: a chart by these rules, at least one yarn, and crossings that together take no more
/// than max_crossing_fraction of the rows.
DrawnKnit draw_knit(const KnitChart& chart, const std::string& name);

}  // namespace selvedge
