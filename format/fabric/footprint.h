// Mip level and weight of the yarn from the change of texture coordinates across a pixel (spec/brdf.md, "The
// viewer").
#pragma once

#include <algorithm>
#include <cmath>

#include "format/base/vec.h"

namespace selvedge {

/// Options of texture filtering: which mip levels and texels a pixel shows.
struct LevelOptions {
  int forced_level = -1;       ///< unless -1: this level everywhere, clamped to the last
  float footprint_pixels = 1;  ///< side of what a pixel shows: less than 1 for one of several samples
};

/// Added to the level of which a texel is as wide as a pixel: texels are about half as wide, so that their
/// edges show little.
inline constexpr float level_bias = -1;

/// Change of texture coordinates per pixel to the right and per pixel up, in texels of a level.
struct TexelDerivatives {
  V2f right, up;
};

/// Longer axis of a pixel by its width across, up to which it counts with its area alone; a longer pixel
/// counts as an area shorter by that.
inline constexpr float max_elongation = 8;

/// Width of a square of the pixel's area, in texels of the slopes' level.
inline float pixel_width_texels(const TexelDerivatives& s) {
  const float e = s.right.x * s.right.x + s.up.x * s.up.x;
  const float f = s.right.x * s.right.y + s.up.x * s.up.y;
  const float g = s.right.y * s.right.y + s.up.y * s.up.y;
  const float long2 = (e + g) / 2 + std::sqrt((e - g) * (e - g) / 4 + f * f);
  return std::sqrt(std::max({std::abs(s.right.cross(s.up)), long2 / max_elongation, 1e-24F}));
}

/// The coarser one's weight of two neighbouring levels, from the part of a fractional level behind the point:
/// half of the pixels show one level alone, or most for `steep` ramps.
inline float coarser_level_weight(float part, float steep = 2) {
  return std::clamp((part - 0.5F) * steep + 0.5F, 0.0F, 1.0F);
}

/// Weight of the yarn itself for a pixel of `size` (pixel_width_texels()), where `largest` is
/// max_yarn_pixel_texels(); 0 without yarn.
inline float yarn_weight(float size, float largest) {
  return largest > 0 ? coarser_level_weight(std::log2(largest / size) + 0.5F, 4) : 0;
}

}  // namespace selvedge
