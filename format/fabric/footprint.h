// The texels under a pixel: mip level and weights from the change of texture coordinates across it
// (spec/brdf.md, "The viewer").
#pragma once

#include <algorithm>
#include <cmath>

#include "format/base/vec.h"

namespace selvedge {

/// Change of texture coordinates per pixel to the right and per pixel up, in texels of a level.
struct TexelSlopes {
  V2f right, up;
};

/// Longer axis of a pixel by its width across, up to which it counts with its area alone; a longer pixel
/// counts as an area so much shorter.
inline constexpr float max_elongation = 8;

/// Width of the largest pixel among the texels of its level, which only the coarsest levels exceed.
inline constexpr float max_pixel_size = 3.5F;

/// A level's texels along each side that lie under one pixel.
inline constexpr int max_pixel_texels = 8;

/// Width of a square of the pixel's area, in texels of the slopes' level.
inline float pixel_size(const TexelSlopes& s) {
  const float e = s.right.x * s.right.x + s.up.x * s.up.x;
  const float f = s.right.x * s.right.y + s.up.x * s.up.y;
  const float g = s.right.y * s.right.y + s.up.y * s.up.y;
  const float long2 = (e + g) / 2 + std::sqrt((e - g) * (e - g) / 4 + f * f);
  return std::sqrt(std::max({std::abs(s.right.cross(s.up)), long2 / max_elongation, 1e-24F}));
}

/// The pixel as a parallelogram among the texels of a level, at least as wide as a texel.
struct PixelBox {
  V2f across;  ///< a pixel's coordinate to the right is across . (x, y), -1/2 to 1/2 within it
  V2f along;   ///< the same upwards
  V2f texel;   ///< size of a texel in these coordinates
  V2f reach;   ///< texels whose centres are further away have no share
};

/// `size`: pixel_size(), in texels of the level.
inline PixelBox pixel_box(const TexelSlopes& slopes, float size) {
  constexpr float tiny = 1e-12F;
  const float shrink = std::min(max_pixel_size / size, 1.0F);
  // A side shorter than a texel becomes as long as one: texels are then interpolated.
  const auto lengthened = [](const V2f& side, const V2f& otherwise) {
    const float length = side.length();
    return length > tiny ? side / std::min(length, 1.0F) : otherwise;
  };
  V2f right = lengthened(slopes.right * shrink, V2f(1, 0));
  V2f up = lengthened(slopes.up * shrink, V2f(0, 1));
  // A parallelogram thinner than a texel becomes a strip of both sides' length.
  if (!(std::abs(right.cross(up)) > std::min(right.length(), up.length()) / 2)) {
    right += right.dot(up) > 0 ? up : -up;
    up = V2f(-right.y, right.x) / std::max(right.length(), tiny);
  }
  const float inverse = 1 / right.cross(up);
  PixelBox box;
  box.across = V2f(up.y, -up.x) * inverse;
  box.along = V2f(-right.y, right.x) * inverse;
  box.texel = {box.across.length(), box.along.length()};
  const V2f half = (V2f(1, 1) + box.texel) / 2;
  constexpr float most = 0.5F * max_pixel_texels;
  box.reach = {std::min(std::abs(right.x) * half.x + std::abs(up.x) * half.y, most),
               std::min(std::abs(right.y) * half.x + std::abs(up.y) * half.y, most)};
  return box;
}

/// Share of a texel whose centre lies so many texels from the pixel's, times a constant: exactly the area
/// under the pixel where both have the same directions.
inline float texel_share(const PixelBox& box, const V2f& from_centre) {
  if (!(std::abs(from_centre.x) < box.reach.x && std::abs(from_centre.y) < box.reach.y)) return 0;
  const auto overlap = [](float texel, float away) {
    return std::min(std::max((1 + texel) / 2 - std::abs(away), 0.0F), std::min(texel, 1.0F));
  };
  return overlap(box.texel.x, box.across.dot(from_centre)) * overlap(box.texel.y, box.along.dot(from_centre));
}

/// The coarser one's weight of two neighbouring levels, from the part of a fractional level behind the point:
/// half of the pixels show one level alone, or most for `steep` ramps.
inline float blend_of_levels(float part, float steep = 2) {
  return std::clamp((part - 0.5F) * steep + 0.5F, 0.0F, 1.0F);
}

/// Scale of largest_yarn_pixel(), which assumes 2 x 2 points: n x n points show the yarn
/// itself in larger pixels, chosen by pictures (docs/view.md).
inline float largest_by_points(int points) { return std::max(0.5F, static_cast<float>(points - 1)); }

/// Weight of the yarn itself for a pixel of `size` (pixel_size()), where `largest` is largest_yarn_pixel(); 0
/// without yarn.
inline float yarn_share(float size, float largest) {
  return largest > 0 ? blend_of_levels(std::log2(largest / size) + 0.5F, 4) : 0;
}

}  // namespace selvedge
