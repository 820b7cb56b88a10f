// Options that several verbs share: input and mesh of a cell, bounces of light.
#pragma once

#include <string>

#include "apps/common/options.h"
#include "converter/bake/bake.h"
#include "converter/stitch/find_cell.h"

namespace selvedge {

/// Declares the input and its mesh options. Returns the option of the input.
Option add_cell(Options& options, std::string& input, CellOptions& cell);

/// Indirect light, of a bake or of a traced swatch.
void add_bounces(Options& options, int& bounces);

}  // namespace selvedge
