// Options that several verbs share: input and mesh of a cell, transport of light.
#pragma once

#include <string>

#include "apps/common/options.h"
#include "converter/bake/bake.h"
#include "converter/stitch/find_cell.h"

namespace selvedge {

/// Declares the input and its mesh options. Returns the option of the input.
Option add_cell(Options& options, std::string& input, CellOptions& cell);

/// Indirect light and reference plane, of a bake or of a traced swatch.
struct TransportOptions {
  int& bounces;
  std::optional<double>& ground;
  ReferencePlane& reference;
};
void add_transport(Options& options, const TransportOptions& transport);

}  // namespace selvedge
