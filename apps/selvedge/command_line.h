// The options of bake, fit, make and trade as plain data.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "apps/common/report.h"
#include "converter/bake/bake.h"
#include "converter/presets/held_out.h"
#include "converter/presets/presets.h"
#include "converter/presets/within_limits.h"
#include "converter/stitch/find_cell.h"
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
  MakeOptions options;  ///< the bake's do not count
  std::string report;   ///< .json, .md or .txt; empty: none
};

struct MakeCommand {
  CommonOptions common;
  std::string input;
  std::string output;
  CellOptions cell;
  MakeOptions options = *preset_named(default_preset);  ///< the preset's, unless another is chosen
  std::string pairs;                                    ///< file of pairs; empty: random ones
  bool texels_given = false;                            ///< else the stitch may demand more
  std::string samples;                                  ///< where they are kept; empty: nowhere
  std::string report;                                   ///< .json, .md or .txt; empty: none
  std::string plan;  ///< file of a plan, for which no more is made than it needs; empty: everything
  std::vector<std::string> materials;  ///< of the plan; empty: all of them
  std::string quality{default_preset};
  MakeLimits limits;  ///< where there are any they choose the knobs, and the quality does not count
};

struct TradeCommand {
  CommonOptions common;
  std::string input;
  std::vector<std::string> settings;  ///< of the stitch, as they were given: for the points' command lines
  CellOptions cell;
  std::string output;  ///< a folder
  std::string grid;    ///< file; empty: the measured settings of the presets
  int repeats = 3;     ///< of everything that is timed
  V2i size{160, 120};  ///< of pictures
  int truth_samples = 64;
  HeldOutOptions held_out;  ///< its texels are those of the finest point
  bool keep_samples = false;
};

}  // namespace selvedge
