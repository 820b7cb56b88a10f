// A picture of a comparison: truth, fit and difference for some held-out pairs, and the error over the angles
// of view and light and over the levels, for held-out and training pairs; and the same of another model.
#pragma once

#include <string>
#include <vector>

#include "format/fabric/fabric.h"
#include "format/quality/compare.h"
#include "format/samples/samples.h"

namespace selvedge {

struct PlotNames {
  std::string fabric;  ///< file names, for the title
  std::string samples;
  std::uint64_t bytes = 0;  ///< of the fabric's file
  std::string model{};      ///< of the model whose answers are drawn
};

/// An SVG file. `training`: as TrainingPairs gives them. `model`: answers of a model for the held-out pairs,
/// drawn beside the fabric; empty: none. Refuses what compare() refuses, and samples without held-out pairs
/// (samples_malformed).
Result<std::string> compare_plot(const Fabric& fabric, const PairSamples& held_out,
                                 const PairSamples& training, const PlotNames& names,
                                 const PairAnswers& model = {});

}  // namespace selvedge
