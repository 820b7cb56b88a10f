// Converts knitting charts to patterns: yarns whose loops are drawn through each other.
#pragma once

#include <string>
#include <vector>

#include "converter/stitch/pattern.h"

namespace selvedge {

/// One repeat of a knit as knitters chart it, seen from the face. A row is one course, worked from left to
/// right here, one character per stitch:
///   k  knit: the loop is drawn through the one below from the back to the front
///   p  purl: from the front to the back
///   o  yarn over: a loop that is drawn through none
///   /  the loop is drawn through the one below and its left neighbour, which leans over it
///   \  the loop is drawn through the one below and its right neighbour, which leans over it
/// Every loop but the neighbours of a decrease continues in the stitch above it, which must not be a yarn
/// over; a neighbour's own column has the yarn over that keeps the count.
struct KnitChart {
  std::vector<std::string> rows;  ///< from the bottom upwards, all of one length
  double wale_mm = 5;             ///< width of one stitch
  double course_mm = 3.8;         ///< height of one course
  std::vector<Yarn> yarns;        ///< without segments; course c is knitted with yarn c modulo their number
};

/// The yarns of the chart, each course one chain, with radii at which they do not touch
/// (RelaxOptions::start). Precondition: a chart by these rules with at least one yarn.
StitchPattern draw_knit(const KnitChart& chart, const std::string& name);

}  // namespace selvedge
