// Which mip levels of a fabric the pixels of a frame can ask for, known before any of them is drawn or read.
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

/// First and last of the levels that pixels may ask for.
struct LevelRange {
  int first = 0;
  int last = 0;
};

/// Of a fabric with as many levels as there can be; `cover` in texels of its level 0. Options that force a
/// level are not looked at. Where no pixel shows it, all there is is the last of `levels`.
LevelRange levels_asked(const PixelCover& cover, const LevelOptions& options, int levels);

/// The texels that pixels ask for of some cloth, whichever fabric it is.
struct TexelDemand {
  double min_mm = 0;  ///< PixelCover::least, of millimetres of cloth; infinite: not seen
  double max_mm = 0;  ///< PixelCover::most; may be infinite
  double bias = 0;    ///< LevelOptions::bias
};

/// The finest level that the demand needs of cloth whose texels at level 0 have these sides (mm), 0 to
/// `levels` - 1, and the coarsest. With a little to spare: a level more where it is nearly needed.
LevelRange levels_for(const TexelDemand& demand, const V2d& texel_mm, int levels);

/// How many levels of the whole may be asked for that a file does not have, as far as it says.
struct LackingLevels {
  int finer = 0;  ///< before its first
  int coarser = 0;

  bool any() const { return finer > 0 || coarser > 0; }
  LackingLevels& operator|=(const LackingLevels& other);
};

/// Of `asked` of the whole fabric.
LackingLevels lacking_levels(const FabricHeader& header, const LevelRange& asked);

/// FABRIC_LEVELS at /whole of the fabric `name` where one level is shown everywhere, `wanted` of the whole or
/// its last, and the file does not have it.
std::optional<Error> lacking_issue(const std::string& name, const FabricHeader& header, int wanted);

/// The warning of them: FABRIC_LEVELS at /whole of the fabric `name`.
Error lacking_issue(const std::string& name, const FabricHeader& header, const LackingLevels& lacking);

/// The levels of each file that a frame of `height` pixels can ask for, by their numbers in the file: never
/// too few. Materials name the fabrics of `headers`.
/// `lacking`, where it is not null: the levels that the frame may ask for beyond them.
std::vector<LevelRange> levels_asked(const Scene& scene, const Camera& camera, int height,
                                     const LevelOptions& options,
                                     std::span<const FabricHeader* const> headers,
                                     std::vector<LackingLevels>* lacking = nullptr);

}  // namespace selvedge
