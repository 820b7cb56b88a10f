// Bands of rows, in which a frame is drawn to bound its memory and to shade one band while the next is drawn.
#pragma once

#include <cstddef>
#include <vector>

#include "format/picture/frame.h"
#include "viewer/frame/options.h"

namespace selvedge {

/// The supersampled frame, in pixels.
struct FrameBands {
  int width = 1;
  int height = 1;
  int rows = 1;  ///< of a band; the last one may have fewer
  int supersample = 1;
  int band_row_count(int first_row) const { return first_row + rows < height ? rows : height - first_row; }
  bool operator==(const FrameBands&) const = default;
};

/// Bands with a multiple of `supersample` rows, and an even number, so that OpenGL's quads of 2 x 2 pixels
/// are aligned in every band.
FrameBands bands_of(const FrameSize& size);

/// The output pixels of a band: radiance times opacity, and opacity. Row y, counted from the band's bottom,
/// begins at bottom + y * stride.
struct BandPixels {
  int first_row = 0;  ///< of the frame, counted from its bottom
  int width = 1;
  int rows = 1;
  V4f* bottom = nullptr;
  std::ptrdiff_t stride = 0;
  int supersample = 1;
  V4f& at(int x, int y) const { return bottom[y * stride + x]; }
};

/// The pixels of the band that begins at `first_row`: pixels of the frame, or with supersampling pixels of
/// `large`, which filter_band() averages.
BandPixels pixels_of(const FrameBands& bands, int first_row, Frame& frame, std::vector<V4f>& large);
void filter_band(const FrameBands& bands, int first_row, const std::vector<V4f>& large, Frame& frame);

}  // namespace selvedge
