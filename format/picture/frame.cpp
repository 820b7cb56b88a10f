#include "format/picture/frame.h"

namespace selvedge {

void box_filter(std::span<const V4f> large, int first_row, int n, Frame& frame) {
  const std::size_t large_width = std::size_t{1} * frame.width * n;
  const auto rows = static_cast<int>(large.size() / large_width) / n;
  const float scale = 1.0F / static_cast<float>(n * n);
  for (int row = 0; row < rows; ++row) {
    const int y = frame.height - 1 - (first_row / n + row);
    if (y < 0) break;
    for (int x = 0; x < frame.width; ++x) {
      V4f sum(0, 0, 0, 0);
      for (int j = 0; j < n; ++j) {
        const std::size_t start = (row * n + j) * large_width + x * n;
        for (int i = 0; i < n; ++i) sum += large[start + i];
      }
      frame.pixels[std::size_t{1} * y * frame.width + x] = sum * scale;
    }
  }
}

Image to_linear_image(const Frame& frame) {
  Image image{frame.width, frame.height, 4, {}};
  image.pixels.reserve(frame.pixels.size() * 4);
  for (const V4f& p : frame.pixels) image.pixels.insert(image.pixels.end(), {p.x, p.y, p.z, p.w});
  return image;
}

}  // namespace selvedge
