// Bands of rows, in which a frame is drawn to bound its memory and to shade one band while the next is drawn.
#pragma once

#include <cstddef>
#include <span>
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

/// The output pixels of a band: radiance times opacity, and opacity. Row y of a picture, counted from the
/// band's bottom, begins at bottoms[picture] + y * stride.
struct BandPixels {
  int first_row = 0;  ///< of the frame, counted from its bottom
  int width = 1;
  int rows = 1;
  std::vector<V4f*> bottoms{};  ///< of pictures that differ by their tints
  std::ptrdiff_t stride = 0;
  int supersample = 1;
  V4f& at(int x, int y, std::size_t picture = 0) const { return bottoms[picture][y * stride + x]; }
};

/// The pixels of the band that begins at `first_row`: pixels of the frames, or with supersampling pixels of
/// `large`, which filter_band() averages.
BandPixels pixels_of(const FrameBands& bands, int first_row, std::span<Frame> frames,
                     std::vector<std::vector<V4f>>& large);
void filter_band(const FrameBands& bands, int first_row, const std::vector<std::vector<V4f>>& large,
                 std::span<Frame> frames);

}  // namespace selvedge
