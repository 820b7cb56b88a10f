// Stored values to pictures in some sizes, for the readers of pictures.
#pragma once

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include "format/picture/image.h"

namespace selvedge {

/// Linear colours of stored values. Those of 8 and 16 bits are few, and a power takes long.
class Decoder {
 public:
  /// `bits` of a stored value: 8, 16, or others, which are not remembered.
  explicit Decoder(int bits)
      : largest_(static_cast<float>((1 << (bits == 8 ? 8 : 16)) - 1)),
        known_(bits == 8 || bits == 16 ? std::size_t{1} << bits : 0, -1.0F) {}
  float linear(float stored) {
    if (known_.empty()) return srgb_to_linear(stored);
    float& known = known_[static_cast<std::size_t>(std::lround(stored * largest_))];
    if (known < 0) known = srgb_to_linear(stored);
    return known;
  }

 private:
  float largest_;
  std::vector<float> known_;
};

/// Size of the picture in a file.
struct StoredSize {
  int width;
  int height;
};

/// The number of `from` pixels along a side that fall on pixel `at` of `to`.
inline std::int64_t count_on(std::int64_t at, std::int64_t from, std::int64_t to) {
  return ((at + 1) * from + to - 1) / to - (at * from + to - 1) / to;
}

/// Adds row `y` of a file to the row of a smaller picture on which it falls.
inline void add_row(const std::vector<float>& line, std::int64_t y, const StoredSize& stored, Image& image) {
  const std::int64_t first = y * image.height / stored.height * image.width * 4;
  image.pixels.resize(first + std::int64_t{4} * image.width);
  const float* from = line.data();
  for (std::int64_t x = 0; x < image.width; ++x) {
    float* pixel = &image.pixels[first + 4 * x];
    for (std::int64_t left = count_on(x, stored.width, image.width); left > 0; left -= 1, from += 4)
      for (int c = 0; c < 4; ++c) pixel[c] += from[c];
  }
}

inline void divide_by_counts(Image& image, const StoredSize& stored) {
  for (std::int64_t y = 0; y < image.height; ++y) {
    const std::int64_t rows = count_on(y, stored.height, image.height);
    for (std::int64_t x = 0; x < image.width; ++x) {
      const auto count = static_cast<float>(rows * count_on(x, stored.width, image.width));
      for (int c = 0; c < 4; ++c) image.pixels[(y * image.width + x) * 4 + c] /= count;
    }
  }
}

/// The chunks of a PNG that its pixels need. Each of a thousand texts and profiles would be decompressed, to
/// up to 8 MB, which no header declares.
inline std::vector<std::uint8_t> without_texts(std::span<const std::uint8_t> png) {
  constexpr std::size_t signature = 8;
  constexpr std::size_t around = 12;  // a chunk's length, name and checksum
  std::vector<std::uint8_t> kept(png.begin(), png.begin() + std::min(png.size(), signature));
  for (png = png.subspan(kept.size()); png.size() >= around;) {
    const std::size_t length = std::size_t{png[0]} << 24U | png[1] << 16U | png[2] << 8U | png[3];
    const std::string_view type(reinterpret_cast<const char*>(&png[4]), 4);
    const auto chunk = png.first(std::min(png.size(), length + around));
    if (type == "IHDR" || type == "PLTE" || type == "tRNS" || type == "IDAT" || type == "IEND")
      kept.insert(kept.end(), chunk.begin(), chunk.end());
    png = png.subspan(chunk.size());
  }
  return kept;
}

}  // namespace selvedge
