// Options that several verbs take: what a cell is made from, how a bake lights it, how a fabric is fitted.
#pragma once

#include <string>

#include "apps/common/options.h"
#include "apps/selvedge/command_line.h"

namespace selvedge {

/// The input and what its mesh is made by. Gives back the option of the input.
Option add_cell(Options& options, std::string& input, CellOptions& cell);
/// --set. `texts`: the settings as they were given, where they are wanted.
void add_settings(Options& options, CellOptions& cell, std::vector<std::string>* texts = nullptr);
void add_bake(Options& options, BakeOptions& bake, std::string& pairs_file);

/// What bounces, and where the texels' plane lies: of a bake and of a traced swatch.
struct TransportOptions {
  int& bounces;
  IndirectLight& indirect;
  std::optional<double>& ground;
  ReferencePlane& reference;
};
void add_transport(Options& options, const TransportOptions& transport);
void add_fit(Options& options, MakeOptions& make, std::string& report);

}  // namespace selvedge
