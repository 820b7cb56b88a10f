// A picture of a comparison: truth, fit and difference for some held-out pairs, and the error over the angles
// of view and light and over the levels, for held-out and training pairs.
#pragma once

#include <string>
#include <vector>

#include "format/fabric/fabric.h"
#include "format/samples/samples.h"

namespace selvedge {

struct PlotNames {
  std::string fabric;  ///< file names, for the title
  std::string samples;
  std::uint64_t bytes = 0;  ///< of the fabric's file
};

/// Indices of at most `count` pairs, from those whose directions are both steep to the most grazing, evenly
/// over the order of their flatter direction.
std::vector<std::size_t> spread_pairs(const std::vector<DirectionPair>& pairs, std::size_t count);

/// Linear RGB for a number of [-1, 1], beyond them that of the ends: blue below 0, nearly white at 0, red
/// above. Equal steps are equal steps of lightness on both sides, for colour-blind eyes as well.
V3f diverging_colour(double t);

/// An SVG file. `training`: as TrainingPairs gives them. Refuses what compare() refuses, and samples without
/// held-out pairs (samples_malformed).
Result<std::string> compare_plot(const Fabric& fabric, const PairSamples& held_out,
                                 const PairSamples& training, const PlotNames& names);

}  // namespace selvedge
