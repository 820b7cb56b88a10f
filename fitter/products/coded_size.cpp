#include "fitter/products/coded_size.h"

#include <utility>

#include "format/exr/exr.h"

namespace selvedge {

double coded_bytes(const std::vector<float>& values, std::size_t channels, std::size_t width) {
  if (values.empty()) return 0;
  ExrPart part;
  part.width = static_cast<int>(width);
  part.height = static_cast<int>(values.size() / channels / width);
  part.has_mipmaps = true;
  part.channels.resize(channels);
  ExrPixels pixels{part.width, part.height, std::vector<std::vector<float>>(channels)};
  for (std::size_t i = 0; i < values.size(); ++i) pixels.planes[i % channels].push_back(values[i]);
  return static_cast<double>(exr_packed_bytes(std::move(part), 0, pixels));
}

}  // namespace selvedge
