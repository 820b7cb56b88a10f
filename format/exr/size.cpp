#include "format/exr/size.h"

#include <Imath/half.h>
#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <utility>

#include "format/base/digest.h"

namespace selvedge {

std::vector<std::uint8_t> encode_exr_chunk(const ExrPart& part, const ExrChunk& chunk,
                                           const ExrPixels& pixels) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(exr_pixel_bytes(part) * chunk.width * chunk.height);
  for (int y = chunk.top; y < chunk.top + chunk.height; ++y) {
    for (const std::size_t channel : exr_channel_order(part)) {
      const float* row = &pixels.planes[channel][std::size_t{1} * y * pixels.width + chunk.left];
      const bool half = part.channels[channel].is_half;
      for (int x = 0; x < chunk.width; ++x) {
        const auto bits = half ? Imath::half(row[x]).bits() : std::bit_cast<std::uint32_t>(row[x]);
        for (int shift = 0; shift < (half ? 16 : 32); shift += 8)
          bytes.push_back(static_cast<std::uint8_t>(bits >> shift));
      }
    }
  }
  if (!part.is_zipped) return bytes;
  // First the even bytes, then the odd ones, each as its difference from the byte before, plus 128.
  std::vector<std::uint8_t> differences;
  differences.reserve(bytes.size());
  for (const std::size_t first : {0, 1})
    for (std::size_t i = first; i < bytes.size(); i += 2) differences.push_back(bytes[i]);
  for (std::size_t i = bytes.size(); i-- > 1;)
    differences[i] = static_cast<std::uint8_t>(differences[i] - differences[i - 1] + 128);
  std::vector<std::uint8_t> packed = exr_deflate(differences);
  return packed.size() < bytes.size() ? packed : bytes;
}

Result<void> check_halves(const ExrPart& part, const ExrPixels& pixels, const std::string& file) {
  constexpr float max_half = 65504;
  for (std::size_t c = 0; c < part.channels.size(); ++c) {
    const std::vector<float>& plane = pixels.planes[c];
    for (std::size_t i = 0; part.channels[c].is_half && i < plane.size(); ++i) {
      if (std::abs(plane[i]) <= max_half) continue;
      return fail(Code::fabric_not_finite, file,
                  fmt::format("{}/{}/pixel {},{}", part.name, part.channels[c].name, i % pixels.width,
                              i / pixels.width),
                  fmt::format("{} does not fit into half precision", plane[i]));
    }
  }
  return {};
}

std::uint64_t exr_packed_bytes(ExrPart part, int level, const ExrPixels& pixels) {
  part = exr_with_defaults(std::move(part));
  std::uint64_t sum = 0;
  for (const ExrChunk& chunk : exr_chunks(part))
    if (chunk.level == level) sum += encode_exr_chunk(part, chunk, pixels).size();
  return sum;
}

std::uint64_t exr_file_bytes(std::vector<ExrPart> parts,
                             const std::function<ExrPixels(int part, int level)>& pixels_at) {
  std::uint64_t sum = 0;
  for (ExrPart& part : parts) {
    part = exr_with_defaults(std::move(part));
    // Each chunk's offset, and its header: its part and place, and the size.
    sum += exr_chunk_count(part) * (part.has_mipmaps ? 32 : 20);
    const auto index = static_cast<int>(&part - parts.data());
    for (int level = 0; level < part.levels; ++level)
      sum += exr_packed_bytes(part, level, pixels_at(index, level));
  }
  return sum + encode_exr_headers(parts).size();
}

std::string digest_of(const ExrPart& part, const ExrPixels& pixels) {
  Digest digest;
  std::vector<Imath::half> halves;
  for (const std::size_t channel : exr_channel_order(part)) {
    const std::vector<float>& plane = pixels.planes[channel];
    if (part.channels[channel].is_half) {
      halves.assign(plane.begin(), plane.end());
      digest.update(halves.data(), halves.size() * sizeof(Imath::half));
    } else {
      digest.update(plane.data(), plane.size() * sizeof(float));
    }
  }
  return digest.hex();
}

}  // namespace selvedge
