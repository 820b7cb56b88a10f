#include "viewer/frame/bands.h"

#include <algorithm>

namespace selvedge {
namespace {

constexpr int pixels_per_band = 1 << 21;
constexpr int bands_per_frame = 3;
constexpr int rasteriser_tile = 64;

}  // namespace

FrameBands bands_of(const FrameSize& size) {
  FrameBands bands{size.width * size.supersample, size.height * size.supersample, 1, size.supersample};
  if (size.band_rows > 0) {
    bands.rows = size.band_rows * size.supersample;
    return bands;
  }
  // Whole tiles of the rasteriser, small enough that a band is drawn while the previous one is shaded.
  const int fraction =
      (bands.height / bands_per_frame + rasteriser_tile - 1) / rasteriser_tile * rasteriser_tile;
  const int rows = std::clamp(fraction, 1, std::max(pixels_per_band / bands.width, 1));
  const int step = 2 * size.supersample;
  bands.rows = std::max(rows / step, 1) * step;
  return bands;
}

BandPixels pixels_of(const FrameBands& bands, int first_row, Frame& frame, std::vector<V4f>& large) {
  BandPixels pixels{first_row, bands.width, bands.band_row_count(first_row),
                    nullptr,   bands.width, bands.supersample};
  if (bands.supersample > 1) {
    large.resize(pixels.width * pixels.rows);
    pixels.bottom = large.data();
  } else {
    // The frame's first row is at the top.
    pixels.bottom =
        frame.pixels.data() + static_cast<std::ptrdiff_t>(bands.height - 1 - first_row) * bands.width;
    pixels.stride = -bands.width;
  }
  return pixels;
}

void filter_band(const FrameBands& bands, int first_row, const std::vector<V4f>& large, Frame& frame) {
  if (bands.supersample > 1) box_filter(large, first_row, bands.supersample, frame);
}

}  // namespace selvedge
