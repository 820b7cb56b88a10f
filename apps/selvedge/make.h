// The verbs bake, fit and make: stitch -> samples -> fabric.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "apps/common/options.h"
#include "apps/common/report.h"
#include "apps/common/run_key.h"
#include "converter/make/make.h"
#include "converter/make/recolour.h"
#include "converter/stitch/find_cell.h"

namespace selvedge {

/// The options of the three verbs; each declares some of them.
struct MakeCommand {
  CommonOptions common;
  std::string input;  ///< a stitch, or the samples to fit
  std::string output;
  CellOptions cell;
  MakeOptions options = quality_named(default_quality);
  std::string quality{default_quality};
  bool has_texels = false;       ///< if not, the stitch may raise the default
  bool has_bounces = false;      ///< if not, paths within translucent yarn have any number of bounces
  bool has_pair_rays = false;    ///< if not, many texels share the rays of a pair
  Json recipe = Json::object();  ///< options that the fabric depends on, as given
  std::string samples_path;      ///< file to keep them in; empty: none
  std::string recolour_path;     ///< a fabric of the same yarn in other colours; empty: none
  Recolouring recolouring = Recolouring::exact;
  std::string list_path;         ///< file with the words of a make on each line; empty: a single fabric
  std::optional<int> list_line;  ///< of the list, from 1; default: all
  RunKey key;
};

/// Options that a recipe (spec/fabric.md) names, beside --set.
inline constexpr std::array recipe_option_names{
    "quality", "texels", "views", "lights", "samples", "indirect", "bounces", "pairs", "truth-samples",
    "sides",   "yarns",  "seed",  "grid",   "lobes",   "no-table", "bytes",   "kinds", "accuracy"};
/// For pages: the built-in `stitches` and their parameters, as `stitch --list NAME --json` prints them, the
/// `kinds` of yarn, and recipe_option_names.
Json stitches_for_pages();

/// Parses the words of a make. OPTION_OUT_OF_RANGE, of `place` in `file`.
Result<MakeCommand> make_command_of(const std::vector<std::string>& words, const std::string& file,
                                    const std::string& place);

struct MadeFabric {
  BakeReport bake;
  FitOutcome fit;
};

/// Makes the fabrics of a list, or of one of its lines, and reports them.
Result<int> make_from_list(const MakeCommand& command);
/// Makes a fabric and writes its files; nothing where --if-changed keeps them. Throws Failure.
std::optional<MadeFabric> make_file(const MakeCommand& command);

}  // namespace selvedge
