// A stitch that is drawn and then relaxed, with its parameters: what built-in stitches and charts share.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "converter/stitch/chart.h"
#include "converter/stitch/flat_yarn.h"
#include "converter/stitch/library.h"

namespace selvedge {

struct BuiltIn {
  StitchInfo info;
  /// The yarns as drawn, before relaxation.
  std::function<StitchPattern(const StitchValues&, Flat)> draw;
  double max_thickness = 0;  ///< RelaxOptions
  double hold = 0;
  std::size_t warps = 0;  ///< of a weave: its first yarns, wefts are behind them
  /// The names of the parameters that are radii, for a message.
  std::string radii;
  StitchSettings settings;  ///< of its chart, where a user sets no others
};

StitchParameter length_parameter(const std::string& name, double value, const std::string& meaning);
StitchParameter slack_parameter();

void append(std::vector<StitchParameter>& parameters, const std::vector<StitchParameter>& more);
/// The parameters of one yarn beside its radius; their defaults are those of its kind.
void append_yarn(std::vector<StitchParameter>& parameters, const std::string& prefix, int kind,
                 double shorter_mm, Yarn yarn);

/// The parameter, a radius: not set, it scales with the gauge.
double radius_for(const StitchValues& values, const std::string& name, double gauge);

/// The knit of a chart. Its first yarn's parameters have no prefix, those of the others "second_", "third_"
/// and so on.
BuiltIn knit(const std::string& description, const ChartText& chart);

/// The built-in knits, in the order of their list.
std::vector<BuiltIn> built_in_knits();

}  // namespace selvedge
