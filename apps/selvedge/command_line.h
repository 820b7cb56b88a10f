// The command line of selvedge as plain data: one struct per verb.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "apps/common/program.h"
#include "converter/bake/bake.h"
#include "converter/bake/truth_swatch.h"
#include "converter/dress/dress.h"
#include "converter/dress/reattach.h"
#include "converter/plan/scene_plan.h"
#include "converter/presets/presets.h"
#include "converter/presets/within_limits.h"
#include "converter/stitch/find_cell.h"
#include "format/fabric/file.h"
#include "format/fabric/level_options.h"

namespace selvedge {

/// What every verb takes.
struct CommonOptions {
  bool json = false;       ///< the report as JSON on standard output
  bool quiet = false;      ///< no progress, no table
  int threads = 0;         ///< 0: all cores
  std::uint64_t seed = 0;  ///< of verbs that draw no random numbers: taken, not used
};

struct StitchCommand {
  CommonOptions common;
  bool list = false;
  bool show = false;   ///< the description on standard output
  std::string input;   ///< built-in name, stitch description, weaving draft or mesh file
  std::string output;  ///< .obj, .ply or .json; empty: report only
  CellOptions cell;
};

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

struct MergeCommand {
  CommonOptions common;
  std::vector<std::string> shards;
  std::string output;
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

struct PlanCommand {
  CommonOptions common;
  std::string scene;
  std::string output;  ///< .json; empty: report only
  PlanOptions plan;
};

struct DressCommand {
  CommonOptions common;
  std::string garment;
  std::string fabric;
  std::string output;
  DressOptions dress;
};

struct ReattachCommand {
  CommonOptions common;
  std::string input;
  std::string output;
  ReattachOptions reattach;
};

struct CheckCommand {
  CommonOptions common;
  std::vector<std::string> files;
  bool warnings_as_errors = false;
};

struct InfoCommand {
  CommonOptions common;
  std::string file;
};

struct EvaluateCommand {
  CommonOptions common;
  std::string fabric;
  double level = 0;
  std::optional<V2i> texel;
  std::optional<V2d> uv;
  V3d light{0, 0, 1};
  V3d view{0, 0, 1};
};

struct AnswerCommand {
  CommonOptions common;  ///< its answers are JSON in any case
};

struct RepackCommand {
  CommonOptions common;
  std::string input;
  std::string output;
  LayerSet to_half;   ///< what is to be stored in 16 bits
  LayerSet to_float;  ///< in 32 bits; layers in neither stay as they are
  LayerSet layers = LayerSet::all();
  std::optional<V2i> levels;  ///< first and last; all where it is not given
  std::string codec = FabricWriteOptions{}.codec;
};

struct CompareCommand {
  CommonOptions common;
  std::vector<std::string> files;  ///< fabrics, then the samples
  std::string plot;                ///< .png or .svg of the one fabric; empty: none
};

struct SwatchCommand {
  CommonOptions common;
  bool truth = false;  ///< the input is a stitch and is traced; else it is a fabric file
  std::string input;
  std::string output;  ///< .png or .exr
  CellOptions cell;    ///< with `truth`
  TruthOptions trace;
  SwatchView view = SwatchView::near;
  V2i size{320, 240};
  std::vector<Light> lights;          ///< empty: those of the view
  LevelOptions levels = best_levels;  ///< without `truth`
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
  int held_out_pairs = 48;
  int held_out_samples = 32;
  bool keep_samples = false;
};

using Command =
    std::variant<ExitNow, StitchCommand, BakeCommand, MergeCommand, FitCommand, MakeCommand, DressCommand,
                 ReattachCommand, CheckCommand, InfoCommand, EvaluateCommand, AnswerCommand, RepackCommand,
                 CompareCommand, PlanCommand, SwatchCommand, TradeCommand>;

Command parse_command_line(int argc, const char* const* argv);

}  // namespace selvedge
