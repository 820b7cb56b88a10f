// Options of texture filtering: which mip levels and texels a pixel shows, and their defaults.
#pragma once

namespace selvedge {

/// Maximum number of taps along the longer axis of a pixel's footprint.
inline constexpr int max_taps = 16;

struct LevelOptions {
  bool blend = true;  ///< between the two nearest levels
  int forced = -1;    ///< unless -1: this level of the whole fabric everywhere, clamped to those in the file
  int taps = 1;       ///< maximum along the longer axis of a pixel's footprint, 1 ... max_taps
  float bias = 0;     ///< added to the level
  /// Bilinear interpolation, wherever a pixel is larger than a texel of level 0; texels of level 0 keep their
  /// edges. Counts as 4 taps.
  bool linear = false;
  /// Points along either side of a pixel where it is small enough to show the yarn itself (level -1).
  int points = 2;
};

/// The defaults of pictures: in most views nearest to supersampling, with little flicker in a slow zoom
/// (docs/view.md). The bias of half a level restores sharpness that linear taps lose.
inline constexpr LevelOptions best_levels{true, -1, 4, -0.5F, true};

/// Maximum of LevelOptions::taps with and without `linear`.
constexpr int tap_limit(bool linear) { return linear ? max_taps / 4 : max_taps; }

}  // namespace selvedge
