// Which mip levels and texels pixels see: how a user asks for them, and what pictures are drawn with unless
// something else is asked for.
#pragma once

namespace selvedge {

/// The most texels along the longer axis of a pixel's footprint.
inline constexpr int max_taps = 16;

struct LevelOptions {
  bool blend = true;
  int forced = -1;  ///< not -1: this level of the whole fabric everywhere, clamped to those that are there
  int taps = 1;     ///< at most so many along the longer axis of a pixel's footprint, 1 ... max_taps
  float bias = 0;   ///< added to the level
  /// Between the four nearest texels of a level, in proportion to their distance, wherever a pixel holds more
  /// than a texel of level 0; texels of level 0 keep their edges. Counts as 4 taps.
  bool linear = false;
};

/// What pictures are drawn with unless something else is asked for: in most views nearest to many samples a
/// pixel, with little flicker in a slow zoom (docs/view.md). Half a level finer: what linear taps lose in
/// sharpness they need not lose twice.
inline constexpr LevelOptions best_levels{true, -1, 4, -0.5F, true};

/// The most taps along the footprint with and without `linear`.
constexpr int tap_limit(bool linear) { return linear ? max_taps / 4 : max_taps; }

}  // namespace selvedge
