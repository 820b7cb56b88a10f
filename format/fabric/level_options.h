// Options of texture filtering: which mip levels and texels a pixel shows.
#pragma once

namespace selvedge {

struct LevelOptions {
  int forced = -1;  ///< unless -1: this level everywhere, clamped to the last
  /// Rays along either side of a pixel where it is small enough to show the yarn itself (level -1).
  int points = 2;
  float footprint = 1;  ///< side of what a pixel shows, in pixels: less than 1 for one of several samples
};

/// Added to the level of which a texel is as wide as a pixel: texels are about half as wide, so that their
/// edges show little.
inline constexpr float level_bias = -1;

}  // namespace selvedge
