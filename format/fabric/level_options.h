// Options of texture filtering: which mip levels and texels a pixel shows, and their defaults.
#pragma once

namespace selvedge {

struct LevelOptions {
  bool blend = true;  ///< between the two nearest levels
  int forced = -1;    ///< unless -1: this level everywhere, clamped to the last
  float bias = 0;     ///< added to the level
  /// The mean of the texels under the pixel, by their shares of its area; else the nearest texel.
  bool area = false;
  /// Points along either side of a pixel where it is small enough to show the yarn itself (level -1).
  int points = 2;
  float footprint = 1;  ///< side of what a pixel shows, in pixels: less than 1 for one of several samples
};

/// The defaults of pictures. Texels are then about half as wide as a pixel, so that their edges show little.
inline constexpr LevelOptions best_levels{true, -1, -1, true};

}  // namespace selvedge
