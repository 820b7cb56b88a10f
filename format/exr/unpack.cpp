#include "format/exr/unpack.h"

#include <zlib.h>

#include <algorithm>
#include <vector>

namespace selvedge {
namespace {

bool inflate_all(std::span<const std::uint8_t> packed, std::span<std::uint8_t> bytes) {
  uLongf count = bytes.size();
  return uncompress(bytes.data(), &count, packed.data(), packed.size()) == Z_OK && count == bytes.size();
}

/// Decodes runs: a count c >= 0 and a byte to repeat c + 1 times, or a count c < 0 and -c bytes to copy.
bool expand_runs(std::span<const std::uint8_t> packed, std::span<std::uint8_t> bytes) {
  while (!packed.empty()) {
    const auto count = static_cast<std::int8_t>(packed.front());
    packed = packed.subspan(1);
    const bool repeated = count >= 0;
    const std::size_t length = repeated ? count + 1 : -count;
    const std::size_t packed_length = repeated ? 1 : length;
    if (length > bytes.size() || packed_length > packed.size()) return false;
    if (repeated) {
      std::fill_n(bytes.begin(), length, packed.front());
    } else {
      std::copy_n(packed.begin(), length, bytes.begin());
    }
    packed = packed.subspan(packed_length);
    bytes = bytes.subspan(length);
  }
  return bytes.empty();
}

/// Inverts the transform before RLE and ZIP: first the even bytes, then the odd ones, each as its difference
/// from the byte before, plus 128.
void undo_differences(std::span<std::uint8_t> differences, std::span<std::uint8_t> pixels) {
  for (std::size_t i = 1; i < differences.size(); ++i) {
    differences[i] = static_cast<std::uint8_t>(differences[i - 1] + differences[i] - 128);
  }
  const std::size_t half = (pixels.size() + 1) / 2;
  for (std::size_t i = 0; i < half; ++i) pixels[2 * i] = differences[i];
  for (std::size_t i = half; i < pixels.size(); ++i) pixels[2 * (i - half) + 1] = differences[i];
}

/// The inverse of undo_differences().
std::vector<std::uint8_t> differences_of(std::span<const std::uint8_t> pixels) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(pixels.size());
  for (std::size_t i = 0; i < pixels.size(); i += 2) bytes.push_back(pixels[i]);
  for (std::size_t i = 1; i < pixels.size(); i += 2) bytes.push_back(pixels[i]);
  for (std::size_t i = bytes.size(); i-- > 1;) {
    bytes[i] = static_cast<std::uint8_t>(bytes[i] - bytes[i - 1] + 128);
  }
  return bytes;
}

}  // namespace

std::size_t exr_zip_size(std::span<const std::uint8_t> pixels) {
  const std::vector<std::uint8_t> bytes = differences_of(pixels);
  uLongf size = compressBound(bytes.size());
  std::vector<std::uint8_t> packed(size);
  // Cannot fail: the buffer has the maximum size.
  compress(packed.data(), &size, bytes.data(), bytes.size());
  return size;
}

bool exr_unpack(const ExrPart& part, const ExrChunk& chunk, std::span<const std::uint8_t> packed,
                std::span<std::uint8_t> pixels) {
  if (packed.size() == pixels.size()) {  // NONE, or a chunk that compression did not make smaller
    std::copy(packed.begin(), packed.end(), pixels.begin());
    return true;
  }
  if (part.compression == "piz") return exr_unpack_piz(part, chunk, packed, pixels);
  std::vector<std::uint8_t> differences(pixels.size());
  const bool whole =
      part.compression == "rle" ? expand_runs(packed, differences) : inflate_all(packed, differences);
  if (whole) undo_differences(differences, pixels);
  return whole;
}

}  // namespace selvedge
