// The options of bake, fit, make and trade as plain data.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/common/report.h"
#include "converter/bake/bake.h"
#include "converter/presets/make_within.h"
#include "converter/presets/settings.h"
#include "converter/stitch/find_cell.h"
#include "fitter/fit.h"
#include "format/fabric/file.h"
#include "format/scene/level_bounds.h"

namespace selvedge {

struct BakeCommand {
  CommonOptions common;
  std::string input;
  std::string output;
  CellOptions cell;
  BakeOptions bake;
  std::string pairs;  ///< file of pairs; empty: random ones
  std::optional<BakeShard> shard;
  bool texels_given = false;          ///< else the stitch may demand more than the default
  std::optional<TexelDemand> demand;  ///< of make: texels and samples are those of the whole, and no more of
                                      ///< it is baked than this needs
  bool chooses = false;               ///< the fit will choose by the validation pairs
};

struct FitCommand {
  CommonOptions common;
  std::string input;
  std::string output;
  FitOptions fit;
  FabricWriteOptions write;
  std::optional<std::uint64_t>
      budget;             ///< bytes of the file; layers are chosen by level (fitter/budget/candidates.h)
  int budget_texels = 0;  ///< the budget is for so many at level 0 and grows with what is more; 0: fixed
  bool smallest_at_least = false;  ///< where none is within the budget, the smallest instead of an error
  std::string report;              ///< .json, .md or .txt; empty: none
};

struct MakeCommand {
  BakeCommand bake;  ///< its output: where the samples are kept; empty: nowhere
  FitCommand fit;    ///< its input is what messages call the samples
  std::string plan;  ///< file of a plan, for which no more is made than it needs; empty: everything
  std::vector<std::string> materials;  ///< of the plan; empty: all of them
  std::string quality;                 ///< the name of settings; empty: none
  MakeLimits limits;                   ///< where there are any they choose the knobs of TradePoint
  std::string given;                   ///< with limits: the other options that count for the fabric's bytes,
                                       ///< as on a command line, each behind a space
};

/// Gives the knobs their values, those for whose options `given` holds excepted.
void set_knobs(const TradePoint& point, const std::function<bool(const char*)>& given, MakeCommand& command);

struct TradeCommand {
  CommonOptions common;
  std::string input;
  std::vector<std::string> settings;  ///< of the stitch, as they were given: for the points' command lines
  CellOptions cell;
  std::string output;  ///< a folder
  std::string grid;    ///< file; empty: default_grid()
  int repeats = 3;     ///< of everything that is timed
  V2i size{160, 120};  ///< of pictures
  int truth_samples = 64;
  int held_out_pairs = 48;
  int held_out_samples = 32;
  bool keep_samples = false;
};

}  // namespace selvedge
