// Options that several verbs share: input and mesh of a cell, its bake, and its fit.
#pragma once

#include <string>

#include "apps/common/options.h"
#include "apps/selvedge/command_line.h"

namespace selvedge {

/// Declares the input and its mesh options. Returns the option of the input.
Option add_cell(Options& options, std::string& input, CellOptions& cell);
/// Declares --set.
void add_settings(Options& options, CellOptions& cell);
void add_bake(Options& options, BakeOptions& bake);

/// Indirect light and reference plane, of a bake or of a traced swatch.
struct TransportOptions {
  int& bounces;
  IndirectLight& indirect;
  std::optional<double>& ground;
  ReferencePlane& reference;
};
void add_transport(Options& options, const TransportOptions& transport);
void add_fit(Options& options, MakeOptions& make);

/// Part I of N from "I/N", 0 <= I < N; refuse()s other texts.
BakeShard shard_from(const std::string& option, const std::string& text);

/// Declares --quality.
void add_quality(Options& options, std::string& quality);
/// Gives the knobs that are not on the command line the values of the quality.
void apply_quality(const Options& options, const std::string& quality, MakeOptions& make);

}  // namespace selvedge
