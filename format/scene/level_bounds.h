// Bounds of the mip levels of fabrics that a frame can ask for, computed before levels are read or drawn.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "format/base/error.h"
#include "format/fabric/header.h"
#include "format/fabric/level_options.h"
#include "format/scene/pixel_cover.h"

namespace selvedge {

/// The first and the last level that pixels may ask for.
struct LevelRange {
  int first = 0;
  int last = 0;
};

/// For a fabric with `levels` levels; `cover` is in texels of its level 0. LevelOptions::forced is ignored.
/// The last level if no pixel shows the fabric.
LevelRange levels_asked(const PixelCover& cover, const LevelOptions& options, int levels);

/// Sizes of pixels on some cloth, for any fabric.
struct TexelDemand {
  double min_mm = 0;   ///< PixelCover::min_size in mm; infinite: not seen
  double max_mm = 0;   ///< PixelCover::max_size; may be infinite
  double bias = 0;     ///< LevelOptions::bias
  bool backs = false;  ///< the cloth is also seen from behind
};

/// The levels, from 0 to `levels` - 1, that the demand needs of cloth with texels of size `texel_mm` (mm) at
/// level 0. Rounded outwards: includes a level that is nearly needed.
LevelRange levels_for(const TexelDemand& demand, const V2d& texel_mm, int levels);

/// Number of levels of the whole that may be asked for and that a file lacks, as far as its header tells.
struct LackingLevels {
  int finer = 0;  ///< before the file's first level
  int coarser = 0;

  bool any() const { return finer > 0 || coarser > 0; }
  LackingLevels& operator|=(const LackingLevels& other);
};

/// `asked`: levels of the whole fabric.
LackingLevels lacking_levels(const FabricHeader& header, const LevelRange& asked);

/// FABRIC_LEVELS at /whole of the fabric `name` if the file lacks the level of the whole that is shown
/// everywhere: `wanted`, clamped to the last.
std::optional<Error> lacking_issue(const std::string& name, const FabricHeader& header, int wanted);

/// FABRIC_LEVELS at /whole of the fabric `name` about the lacking levels.
Error lacking_issue(const std::string& name, const FabricHeader& header, const LackingLevels& lacking);

/// The levels of each file that a frame of `height` pixels can ask for, by their numbers in the file; never
/// too few. Materials refer to `headers` by index. `lacking`, unless null, gets the levels that the frame may
/// ask for and the file lacks.
std::vector<LevelRange> levels_asked(const Scene& scene, const Camera& camera, int height,
                                     const LevelOptions& options,
                                     std::span<const FabricHeader* const> headers,
                                     std::vector<LackingLevels>* lacking = nullptr);

}  // namespace selvedge
