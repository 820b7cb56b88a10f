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

BandPixels pixels_of(const FrameBands& bands, int first_row, std::span<Frame> frames,
                     std::vector<std::vector<V4f>>& large) {
  const bool is_large = bands.supersample > 1;
  // The frame's first row is at the top.
  BandPixels pixels{first_row,
                    bands.width,
                    bands.band_row_count(first_row),
                    {},
                    is_large ? bands.width : -bands.width,
                    bands.supersample};
  large.resize(frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (is_large) large[i].resize(static_cast<std::size_t>(pixels.width) * pixels.rows);
    pixels.bottoms.push_back(is_large ? large[i].data()
                                      : frames[i].pixels.data() +
                                            static_cast<std::ptrdiff_t>(bands.height - 1 - first_row) *
                                                bands.width);
  }
  return pixels;
}

void filter_band(const FrameBands& bands, int first_row, const std::vector<std::vector<V4f>>& large,
                 std::span<Frame> frames) {
  if (bands.supersample == 1) return;
  for (std::size_t i = 0; i < frames.size(); ++i)
    box_filter(large[i], first_row, bands.supersample, frames[i]);
}

}  // namespace selvedge
