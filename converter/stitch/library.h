// The built-in stitches: charts and drawdowns with their lengths, relaxed.
#pragma once

#include <string>
#include <vector>

#include "converter/stitch/parameters.h"
#include "converter/stitch/pattern.h"

namespace selvedge {

struct StitchInfo {
  std::string name;
  std::string description;  ///< one line
  std::vector<StitchParameter> parameters;
};

std::vector<StitchInfo> built_in_stitches();

/// A stitch and what is to be said of it.
struct FoundStitch {
  StitchPattern pattern;
  V2i min_texels{1, 1};                ///< of a fabric that shows every yarn; 1: nothing is demanded
  double thickness_share = 1;          ///< how thick its yarns are, as a share of what a draft says
  std::vector<std::string> remarks{};  ///< what was chosen or left out, one line each
};

/// Overlap of neighbouring yarns, in radii, that still counts as touching.
constexpr double touching_overlap = 0.02;

/// A built-in stitch by its name, or else the stitch description (.json) or the weaving draft (.wif) in a
/// file. Refuses (stitch_unknown) what is neither, (option_out_of_range) settings that it has not, that are
/// out of range, or whose yarns have no room at their gauge.
Result<FoundStitch> find_stitch(const std::string& name_or_path, const StitchSettings& settings = {});

}  // namespace selvedge
