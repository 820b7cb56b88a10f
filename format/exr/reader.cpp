#include <Imath/half.h>
#include <zlib.h>

#include <algorithm>
#include <new>
#include <utility>

#include <fmt/format.h>

#include "format/base/digest.h"
#include "format/base/mip.h"
#include "format/exr/bytes.h"
#include "format/exr/layout.h"

namespace selvedge {

struct ExrReader::State {
  std::string name;
  ExrLimits limits;
  InputFile source;
  ExrLayout layout;
};

const std::string& ExrReader::path() const { return state_->name; }
const std::vector<ExrPart>& ExrReader::parts() const { return state_->layout.parts; }

std::uint64_t ExrReader::packed_bytes(int part, int level) const {
  std::uint64_t sum = 0;
  for (const ExrChunk& chunk : state_->layout.chunks[part])
    if (chunk.level == level) sum += chunk.packed_bytes;
  return sum;
}

int ExrReader::find_part(const std::string& part_name) const {
  const auto& all = parts();
  const auto found = std::ranges::find_if(all, [&](const ExrPart& part) { return part.name == part_name; });
  return found == all.end() ? -1 : static_cast<int>(found - all.begin());
}

Result<ExrReader> ExrReader::open(const std::string& path, const ExrLimits& limits) {
  auto source = InputFile::open(path);
  if (!source) return tl::unexpected(source.error());
  return open(std::make_shared<State>(State{path, limits, std::move(*source), {}}));
}

Result<ExrReader> ExrReader::open(std::span<const std::uint8_t> bytes, const std::string& name,
                                  const ExrLimits& limits) {
  return open(std::make_shared<State>(State{name, limits, InputFile(bytes), {}}));
}

Result<ExrReader> ExrReader::open(std::shared_ptr<State> state) {
  try {
    state->layout = read_exr_layout(state->source, state->limits);
  } catch (Failure& failure) {
    failure.error.file = state->name;
    return tl::unexpected(std::move(failure.error));
  } catch (const std::bad_alloc&) {
    return fail(Code::file_too_large, state->name, {}, "out of memory");
  }
  return ExrReader(std::move(state));
}

namespace {

/// Inverts the transform before ZIP: first the even bytes, then the odd ones, each as its difference from the
/// byte before, plus 128.
void undo_differences(std::span<std::uint8_t> differences, std::span<std::uint8_t> pixels) {
  for (std::size_t i = 1; i < differences.size(); ++i)
    differences[i] = static_cast<std::uint8_t>(differences[i - 1] + differences[i] - 128);
  const std::size_t half = (pixels.size() + 1) / 2;
  for (std::size_t i = 0; i < half; ++i) pixels[2 * i] = differences[i];
  for (std::size_t i = half; i < pixels.size(); ++i) pixels[2 * (i - half) + 1] = differences[i];
}

/// Decodes a chunk: row by row from the top, within a row channel by channel in the part's order,
/// little-endian. False if the packed bytes do not decode to exactly the size of `pixels`. OpenEXR 3.1
/// accepts a chunk that holds too few bytes and returns uninitialised memory for the missing pixels.
bool unpack(std::span<const std::uint8_t> packed, std::span<std::uint8_t> pixels) {
  if (packed.size() == pixels.size()) {  // not compressed
    std::ranges::copy(packed, pixels.begin());
    return true;
  }
  std::vector<std::uint8_t> differences(pixels.size());
  uLongf count = differences.size();
  if (uncompress(differences.data(), &count, packed.data(), packed.size()) != Z_OK || count != pixels.size())
    return false;
  undo_differences(differences, pixels);
  return true;
}

void copy_chunk(const ExrPart& part, const ExrChunk& chunk, std::span<const std::uint8_t> bytes,
                ExrPixels& pixels) {
  for (int y = 0; y < chunk.height; ++y) {
    for (std::size_t c = 0; c < part.channels.size(); ++c) {
      const std::size_t size = part.channels[c].is_half ? 2 : 4;
      float* out = pixels.planes[c].data() + std::size_t{1} * (chunk.top + y) * pixels.width + chunk.left;
      const std::uint8_t* in = bytes.data();
      for (int x = 0; x < chunk.width; ++x, in += size)
        if (size == 2)
          out[x] = Imath::half(Imath::half::FromBits, static_cast<std::uint16_t>(in[0] | in[1] << 8));
        else
          out[x] = ExrByteReader({in, 4}).f32();
      bytes = bytes.subspan(chunk.width * size);
    }
  }
}

}  // namespace

Result<ExrPixels> ExrReader::read_level(int part_index, int level) {
  const ExrPart& part = parts()[part_index];
  const auto refused = [&](Code code, std::string message) {
    return fail(code, path(), part.name, std::move(message));
  };
  if (level < 0 || level >= part.levels) return refused(Code::file_damaged, "the part has no such level");
  ExrPixels pixels{level_size(part.width, level), level_size(part.height, level), {}};
  const std::uint64_t count = std::uint64_t{1} * pixels.width * pixels.height;
  const std::uint64_t bytes = count * part.channels.size() * sizeof(float);
  if (bytes > state_->limits.bytes_per_read)
    return refused(Code::file_too_large, fmt::format("{} bytes of pixels at once", bytes));
  try {
    pixels.planes.assign(part.channels.size(), std::vector<float>(count));
    std::vector<std::uint8_t> packed;
    std::vector<std::uint8_t> unpacked;
    for (const ExrChunk& chunk : state_->layout.chunks[part_index]) {
      if (chunk.level != level) continue;
      packed.resize(chunk.packed_bytes);
      unpacked.resize(exr_pixel_bytes(part) * chunk.width * chunk.height);
      if (!state_->source.read(chunk.offset, packed) || !unpack(packed, unpacked))
        return fail(Code::file_damaged, path(), exr_place(part, chunk), "cannot be decoded");
      copy_chunk(part, chunk, unpacked, pixels);
    }
    return pixels;
  } catch (const std::bad_alloc&) {
    return refused(Code::file_too_large, "out of memory");
  }
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
