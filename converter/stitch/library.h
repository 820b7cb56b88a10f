// Stitches by name or file: charts, drafts and drawdowns, relaxed, and descriptions.
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "converter/stitch/arrange.h"
#include "converter/stitch/parameters.h"
#include "converter/stitch/pattern.h"
#include "converter/stitch/yarn_relax.h"

namespace selvedge {

struct StitchInfo {
  std::string name;
  std::string description;  ///< one line
  std::vector<StitchParameter> parameters;
  double cover_fraction =
      0;  ///< fraction of the area that its yarns cover seen along the normal, at the defaults
};

/// A built-in stitch, all of it: a chart, or the drawdown of a weave of two kinds of yarn.
struct StitchEntry {
  struct Threads {
    double spacing_mm = 0;
    double radius_mm = 0;
    V3f albedo;
  };
  std::string name;
  std::string description;    ///< one line
  double cover_fraction = 0;  ///< as in StitchInfo; a test compares it with textile_numbers()
  std::string chart_text{};   ///< of a knit (spec/chart.md), without a name
  struct {
    std::vector<std::string> rows;  ///< from the top; #: warp over weft
    std::string fibre;              ///< of all yarns (fibres.h)
    Threads warp, weft;
    Gloss gloss{};
  } drawdown{};
};

/// The table of built-in stitches (built_in.cpp), from which all lists of them follow.
std::vector<StitchEntry> built_in_entries();
std::vector<StitchInfo> built_in_stitches();

/// A built-in stitch by its name, or a description, draft or chart in a file, which is read and not drawn;
/// the name is as given. Refuses what find_stitch() refuses without settings, but for yarns without room.
Result<StitchInfo> describe_stitch(const std::string& name_or_path);

/// Name, description and parameters; `byKind`: a parameter whose default follows the kind of yarn.
nlohmann::ordered_json to_json(const StitchInfo& info);

/// A stitch and remarks on it.
struct FoundStitch {
  StitchPattern pattern;
  V2i min_texels{1, 1};           ///< of a fabric that resolves every yarn; 1: no minimum
  double thickness_fraction = 1;  ///< thickness of its yarns, as a fraction of the stated one
  int repeats = 1;                ///< of the stitch, each way, that the pattern holds
  int stitch_count = 0;           ///< of a knit, in the pattern
  int wales = 0;                  ///< the same: columns of stitches
  V2d plain_mm{0, 0};             ///< of a knit: a stitch of plain knit of its yarn, the gauge
  int steps_to_rest = 0;          ///< of a knit: to its rest, and what the last ones freed (RelaxResult)
  double rest_residual = 0;
  std::vector<std::vector<double>>
      part_begins{};                      ///< of a knit's yarns: fractions of their length (KnitPart)
  std::optional<Arrangement> arranged{};  ///< the pattern is its sampler
  std::vector<std::string> remarks{};     ///< choices, omissions and faults, one line each
  std::string file_text{};                ///< of its file; empty of a built-in stitch
};

/// A chart or draft that has been read, before its yarns come to rest.
struct StitchSize {
  int crossing_count = 1;  ///< stitches, or crossings of a warp and a weft, with its repeats
  bool is_woven = false;
  V2i min_texels{1, 1};  ///< as in FoundStitch
  int repeats = 1;
  double length_radii = 0;  ///< length of all plies, in radii of their yarns
  bool is_sampler = false;  ///< of the stitches that a map shows: with one texel for each
};
/// May throw Failure, which refuses the stitch.
using StartCallback = std::function<void(const StitchSize&)>;

/// A built-in stitch by its name, or else the stitch description (.json), the weaving draft (.wif) or the
/// knitting chart (.txt, or a picture, .png) in a file. Refuses other names (stitch_unknown), and settings
/// that the stitch does not have, that are out of range, or whose yarns have no room at their gauge
/// (option_out_of_range). `start` is called for charts and drafts, which `kinds` may make of a sampler;
/// larger ones than max_relaxed_stitches are refused (stitch_invalid) without.
Result<FoundStitch> find_stitch(const std::string& name_or_path, const StitchSettings& settings = {},
                                const StartCallback& start = {}, const Relaxer& relaxer = default_relaxer,
                                const KindLimit& kinds = {});

/// The stitch of an entry, as find_stitch() of its name would give it if it were in the table.
Result<FoundStitch> find_stitch(const StitchEntry& entry, const StitchSettings& settings = {});

}  // namespace selvedge
