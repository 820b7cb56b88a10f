#include <Imath/half.h>
#include <fmt/format.h>
#include <zlib.h>

#include <bit>
#include <cmath>
#include <utility>

#include "format/base/atomic_file.h"
#include "format/base/parallel.h"
#include "format/exr/bytes.h"
#include "format/exr/layout.h"

namespace selvedge {
namespace {

/// As compress2(), whose state takes as long to set up as a level's layer to pack.
struct Deflater {
  z_stream stream{};
  Deflater() { deflateInit(&stream, 4); }
  Deflater(const Deflater&) = delete;
  Deflater& operator=(const Deflater&) = delete;
  ~Deflater() { deflateEnd(&stream); }
};

/// The bytes packed by zlib at level 4, as OpenEXR packs them.
std::vector<std::uint8_t> deflated(std::span<const std::uint8_t> bytes) {
  thread_local Deflater deflater;
  z_stream& stream = deflater.stream;
  deflateReset(&stream);
  std::vector<std::uint8_t> packed(deflateBound(&stream, bytes.size()));
  stream.next_in = const_cast<Bytef*>(bytes.data());
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = packed.data();
  stream.avail_out = static_cast<uInt>(packed.size());
  // Cannot fail: the buffer has the maximum size.
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  return packed;
}

/// The pixels of a chunk as a file has them, packed by ZIP where that makes them smaller.
std::vector<std::uint8_t> encode_chunk(const ExrPart& part, const ExrChunk& chunk, const ExrPixels& pixels) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(exr_pixel_bytes(part) * chunk.width * chunk.height);
  const std::vector<std::size_t> order = exr_channel_order(part);
  for (int y = chunk.top; y < chunk.top + chunk.height; ++y) {
    for (const std::size_t channel : order) {
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
  std::vector<std::uint8_t> packed = deflated(differences);
  return packed.size() < bytes.size() ? packed : bytes;
}

void check_halves(const ExrPart& part, const ExrPixels& pixels, const std::string& file) {
  constexpr float max_half = 65504;
  for (std::size_t c = 0; c < part.channels.size(); ++c) {
    const std::vector<float>& plane = pixels.planes[c];
    for (std::size_t i = 0; part.channels[c].is_half && i < plane.size(); ++i) {
      if (std::abs(plane[i]) <= max_half) continue;
      throw Failure{{Code::fabric_not_finite, file,
                     fmt::format("{}/{}/pixel {},{}", part.name, part.channels[c].name, i % pixels.width,
                                 i / pixels.width),
                     fmt::format("{} does not fit into half precision", plane[i])}};
    }
  }
}

std::string int32_bytes(std::size_t number) { return exr_int32_bytes({static_cast<std::int32_t>(number)}); }

}  // namespace

std::uint64_t exr_packed_bytes(ExrPart part, int level, const ExrPixels& pixels) {
  part = exr_with_defaults(std::move(part));
  std::uint64_t sum = 0;
  for (const ExrChunk& chunk : exr_chunks(part))
    if (chunk.level == level) sum += encode_chunk(part, chunk, pixels).size();
  return sum;
}

std::string exr_file(std::vector<ExrPart> parts, const ExrPixelsAt& pixels_at) {
  for (ExrPart& part : parts) part = exr_with_defaults(std::move(part));
  std::string chunks;               // part by part, level by level
  std::vector<std::size_t> places;  // where each begins
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const ExrPart& part = parts[p];
    const auto index = static_cast<int>(p);
    const std::vector<ExrChunk> all = exr_chunks(part);
    for (std::size_t first = 0, end = 0; first < all.size(); first = end) {
      const int level = all[first].level;
      while (end < all.size() && all[end].level == level) ++end;
      const ExrPixels pixels = pixels_at(index, level);
      std::vector<std::vector<std::uint8_t>> packed(end - first);
      parallel_for(0, static_cast<int>(packed.size()),
                   [&](int i) { packed[i] = encode_chunk(part, all[first + i], pixels); });
      for (std::size_t i = 0; i < packed.size(); ++i) {
        const ExrChunk& chunk = all[first + i];
        places.push_back(chunks.size());
        if (parts.size() > 1) chunks += int32_bytes(p);
        chunks += part.has_mipmaps ? exr_int32_bytes({chunk.column, chunk.row, level, level})
                                   : exr_int32_bytes({chunk.row});
        chunks += int32_bytes(packed[i].size());
        chunks.append(packed[i].begin(), packed[i].end());
      }
    }
  }
  std::string file = encode_exr_headers(parts);
  const std::uint64_t begin = file.size() + 8 * places.size();
  for (const std::size_t place : places)
    file += exr_int32_bytes(
        {static_cast<std::int32_t>(begin + place), static_cast<std::int32_t>((begin + place) >> 32)});
  return std::move(file.append(chunks));
}

Result<void> write_exr_file(const std::string& path, const std::vector<ExrPart>& parts,
                            const ExrPixelsAt& pixels_at) {
  return catch_failure([&] {
    return write_file(path, exr_file(parts, [&](int part, int level) {
                        ExrPixels pixels = pixels_at(part, level);
                        check_halves(parts[part], pixels, path);
                        return pixels;
                      }));
  });
}

}  // namespace selvedge
