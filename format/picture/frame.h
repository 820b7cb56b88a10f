// The finished picture in linear light; display.h makes display values of it.
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

/// Takes rows of an n times larger picture, bottom row first, and writes the means of its n x n boxes into
/// `frame`: `large` starts at row `first_row` (counted from the bottom, a multiple of n) and its width is
/// n * frame.width. Rows beyond the top are left out.
void box_filter(std::span<const V4f> large, int first_row, int n, Frame& frame);

/// As it is: linear, premultiplied, four channels.
Image to_linear_image(const Frame& frame);

/// The inverse. Precondition: four channels.
Frame to_frame(const Image& image);

}  // namespace selvedge
