// The options of bake, fit and make as plain data.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "apps/common/report.h"
#include "converter/bake/bake.h"
#include "converter/presets/presets.h"
#include "converter/presets/within_limits.h"
#include "converter/stitch/find_cell.h"
#include "format/fabric/file.h"

namespace selvedge {

struct BakeCommand {
  CommonOptions common;
  std::string input;
  std::string output;
  CellOptions cell;
  BakeOptions bake = preset_named(default_preset)->bake;
  std::string quality{default_preset};
  std::optional<BakeShard> shard;
  bool texels_given = false;          ///< if not, the stitch may raise the default
  bool bounces_given = false;         ///< if not, yarn that lets light through takes as many as there are
};

struct FitCommand {
  CommonOptions common;
  std::string input;
  std::string output;
  MakeOptions options = *preset_named(default_preset);  ///< those of the bake are ignored
  std::string quality{default_preset};
  std::string made_of;  ///< of make: digest_of_inputs(), which the file records; empty: none
};

/// make --list: many fabrics (fabric_list.h).
struct ListOptions {
  std::string path;          ///< empty: a single fabric
  BakeShard task;            ///< only the fabrics whose index is task.index modulo task.count
  bool as_task = false;      ///< --task is given
  bool bakes_parts = false;  ///< bake the parts of the fabrics that have some, and make nothing
  bool dry_run = false;
  bool keep_going = false;
  std::string page;  ///< a folder; empty: none
};

struct MakeCommand {
  CommonOptions common;
  std::string input;
  std::string output;
  CellOptions cell;
  MakeOptions options = *preset_named(default_preset);  ///< those of the default preset at first
  bool texels_given = false;                            ///< if not, the stitch may raise the default
  bool bounces_given = false;                           ///< if not, translucent yarn takes all
  std::string samples;                                  ///< file to keep them in; empty: none
  std::string quality{default_preset};
  MakeLimits limits;               ///< if there are any, they set the knobs instead of the quality
  std::optional<BakeShard> shard;  ///< bake this part of the samples alone
  int shards = 0;                  ///< above 0: merge so many parts in place of a bake
  std::string depfile;             ///< empty: none
  bool recorded = false;           ///< of a list: the fabric records digest_of_inputs()
  std::string asked;               ///< the options that are given and that the fabric depends on, one a line
  std::string line;  ///< the whole command but for parts, depfile and what is common to all verbs
  ListOptions list;
};

/// Parses the words of a make. OPTION_OUT_OF_RANGE, of `place` in `file`.
Result<MakeCommand> make_command_of(const std::vector<std::string>& words, const std::string& file,
                                    const std::string& place);

}  // namespace selvedge
