// A rendered picture in linear light; display.h converts it to display values.
#pragma once

#include <span>
#include <vector>

#include "format/base/vec.h"
#include "format/picture/image.h"

namespace selvedge {

/// Top row first; pixel (x, y) at y * width + x. xyz: radiance times opacity, w: opacity.
struct Frame {
  int width = 0;
  int height = 0;
  std::vector<V4f> pixels;
};

/// Writes the means of n x n boxes of a larger picture into `frame`. `large` has rows of n * frame.width
/// pixels, bottom row first, from row `first_row` on (counted from the bottom, a multiple of n). Rows beyond
/// the top are ignored.
void box_filter(std::span<const V4f> large, int first_row, int n, Frame& frame);

/// The frame without a display transform: linear, premultiplied, four channels.
Image to_linear_image(const Frame& frame);

}  // namespace selvedge
