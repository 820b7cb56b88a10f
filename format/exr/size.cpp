#include "format/exr/size.h"

#include <Imath/half.h>

#include <algorithm>
#include <bit>
#include <utility>

#include "format/exr/layout.h"

namespace selvedge {

std::uint64_t exr_packed_bytes(ExrPart part, int level, const ExrPixels& pixels) {
  part = exr_with_defaults(std::move(part));
  const std::vector<std::size_t> order = exr_stored_order(part);
  std::uint64_t sum = 0;
  for (const ExrChunk& chunk : exr_chunks(part)) {
    if (chunk.level != level) continue;
    std::vector<std::uint8_t> bytes;
    bytes.reserve(exr_pixel_bytes(part) * chunk.width * chunk.height);
    for (int y = chunk.top; y < chunk.top + chunk.height; ++y) {
      for (const std::size_t channel : order) {
        const float* row = &pixels.planes[channel][std::size_t{1} * y * pixels.width + chunk.left];
        const bool half = part.channels[channel].half;
        for (int x = 0; x < chunk.width; ++x) {
          const auto bits = half ? Imath::half(row[x]).bits() : std::bit_cast<std::uint32_t>(row[x]);
          for (int shift = 0; shift < (half ? 16 : 32); shift += 8)
            bytes.push_back(static_cast<std::uint8_t>(bits >> shift));
        }
      }
    }
    sum += part.zip ? std::min(exr_zip_size(bytes), bytes.size()) : bytes.size();
  }
  return sum;
}

std::uint64_t exr_file_bytes(std::vector<ExrPart> parts,
                             const std::function<ExrPixels(int part, int level)>& pixels_at) {
  std::uint64_t sum = 0;
  for (ExrPart& part : parts) {
    part = exr_with_defaults(std::move(part));
    // Each chunk's header: its part and place, and the size.
    sum += exr_chunk_count(part) * (part.mipmapped ? 24 : 12);
    const auto index = static_cast<int>(&part - parts.data());
    for (int level = 0; level < part.levels; ++level)
      sum += exr_packed_bytes(part, level, pixels_at(index, level));
  }
  return sum + exr_header_bytes(parts);
}

}  // namespace selvedge
