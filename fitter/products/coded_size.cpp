#include "fitter/products/coded_size.h"

#include <Imath/half.h>

#include <algorithm>
#include <cstdint>

#include "format/exr/exr.h"

namespace selvedge {

double coded_bytes(const std::vector<float>& values, std::size_t channels, std::size_t width) {
  if (values.empty()) return 0;
  const std::size_t height = values.size() / channels / width;
  const std::size_t tile = std::max(width, height) <= 32 ? 32 : 64;
  double sum = 0;
  for (std::size_t top = 0; top < height; top += tile) {
    for (std::size_t left = 0; left < width; left += tile) {
      std::vector<std::uint8_t> pixels;
      for (std::size_t y = top; y < std::min(top + tile, height); ++y) {
        for (std::size_t channel = 0; channel < channels; ++channel) {
          for (std::size_t x = left; x < std::min(left + tile, width); ++x) {
            const float value = values[(y * width + x) * channels + channel];
            const std::uint16_t bits = Imath::half(value).bits();
            pixels.push_back(static_cast<std::uint8_t>(bits & 0xFF));
            pixels.push_back(static_cast<std::uint8_t>(bits >> 8));
          }
        }
      }
      sum += static_cast<double>(std::min(exr_zip_size(pixels), pixels.size()));
    }
  }
  return sum;
}

}  // namespace selvedge
