#include <Imath/half.h>
#include <fmt/format.h>

#include <algorithm>
#include <new>
#include <utility>

#include "format/base/mip.h"
#include "format/exr/bytes.h"
#include "format/exr/exr.h"
#include "format/exr/scan.h"
#include "format/exr/unpack.h"

namespace selvedge {

struct ExrReader::State {
  std::string name;
  ExrLimits limits;
  InputFile source;
  ExrScan scan;
  std::uint64_t bytes_read = 0;
};

ExrReader::ExrReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
ExrReader::ExrReader(ExrReader&&) noexcept = default;
ExrReader& ExrReader::operator=(ExrReader&&) noexcept = default;
ExrReader::~ExrReader() = default;
const std::string& ExrReader::name() const { return state_->name; }
const std::vector<ExrPart>& ExrReader::parts() const { return state_->scan.parts; }
std::uint64_t ExrReader::bytes_read() const { return state_->bytes_read; }

std::uint64_t ExrReader::packed_bytes(int part, int level) const {
  std::uint64_t sum = 0;
  for (const ExrChunk& chunk : state_->scan.chunks[part]) {
    if (chunk.level == level) sum += chunk.packed_bytes;
  }
  return sum;
}

int ExrReader::find_part(const std::string& part_name) const {
  const auto& all = parts();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const ExrPart& part) { return part.name == part_name; });
  return found == all.end() ? -1 : static_cast<int>(found - all.begin());
}

Result<ExrReader> ExrReader::open(const std::string& path, const ExrLimits& limits) {
  auto source = InputFile::open(path);
  if (!source) return tl::unexpected(source.error());
  return open(std::make_unique<State>(State{path, limits, std::move(*source), {}, 0}));
}

Result<ExrReader> ExrReader::open(std::span<const std::uint8_t> bytes, const std::string& name,
                                  const ExrLimits& limits) {
  return open(std::make_unique<State>(State{name, limits, InputFile(bytes), {}, 0}));
}

Result<ExrReader> ExrReader::open(std::unique_ptr<State> state) {
  try {
    auto scan = scan_exr(state->source, state->name, state->limits);
    if (!scan) return tl::unexpected(scan.error());
    state->scan = std::move(*scan);
    state->bytes_read = state->scan.bytes;
  } catch (const std::bad_alloc&) {
    return fail(Code::file_too_large, state->name, {}, "out of memory");
  }
  return ExrReader(std::move(state));
}

namespace {

/// Copies the chunk's rows within [first, first + pixels.height) of the level to `pixels`, which begin at
/// `first`.
void copy_chunk(const ExrPart& part, const ExrChunk& chunk, std::span<const std::uint8_t> bytes, int first,
                ExrPixels& pixels) {
  for (int y = 0; y < chunk.height; ++y) {
    const int row = chunk.top + y - first;
    const bool wanted = row >= 0 && row < pixels.height;
    for (std::size_t c = 0; c < part.channels.size(); ++c) {
      const std::size_t size = part.channels[c].half ? 2 : 4;
      if (wanted) {
        float* out = pixels.planes[c].data() + std::size_t{1} * row * pixels.width + chunk.left;
        const std::uint8_t* in = bytes.data();
        for (int x = 0; x < chunk.width; ++x, in += size) {
          if (size == 2) {
            const auto bits = static_cast<std::uint16_t>(in[0] | in[1] << 8);
            out[x] = Imath::half(Imath::half::FromBits, bits);
          } else {
            out[x] = ExrBytes({in, 4}).f32();
          }
        }
      }
      bytes = bytes.subspan(chunk.width * size);
    }
  }
}

}  // namespace

Result<ExrPixels> ExrReader::read_level(int part_index, int level) {
  const ExrPart& part = parts()[part_index];
  // read() refuses levels that do not exist.
  const bool exists = level >= 0 && level < part.levels;
  const int width = exists ? level_size(part.width, level) : 0;
  return read(part_index, level, 0, width, exists ? level_size(part.height, level) : 0);
}

Result<ExrPixels> ExrReader::read_rows(int part_index, int first, int count) {
  return read(part_index, 0, first, parts()[part_index].width, count);
}

Result<ExrPixels> ExrReader::read(int part_index, int level, int first, int width, int height) {
  const ExrPart& part = parts()[part_index];
  const auto refused = [&](Code code, std::string message) {
    return fail(code, name(), part.name, std::move(message));
  };
  if (level < 0 || level >= part.levels || first < 0 || height < 0 ||
      first > level_size(part.height, level) - height) {
    return refused(Code::file_damaged, "the part has no such level or rows");
  }
  if (is_lossy(part.compression)) {
    return refused(Code::exr_unsupported,
                   fmt::format("pixels in the lossy compression '{}' are not read", part.compression));
  }
  const std::uint64_t count = std::uint64_t{1} * width * height;
  const std::uint64_t bytes = count * part.channels.size() * sizeof(float);
  if (bytes > state_->limits.bytes_per_read) {
    return refused(Code::file_too_large, fmt::format("{} bytes of pixels at once", bytes));
  }
  try {
    ExrPixels pixels;
    pixels.width = width;
    pixels.height = height;
    pixels.planes.assign(part.channels.size(), std::vector<float>(count));
    std::vector<std::uint8_t> packed;
    std::vector<std::uint8_t> unpacked;
    for (ExrChunk& chunk : state_->scan.chunks[part_index]) {
      if (chunk.level != level || chunk.top >= first + height || chunk.top + chunk.height <= first) continue;
      if (!std::exchange(chunk.is_read, true)) state_->bytes_read += chunk.packed_bytes;
      packed.resize(chunk.packed_bytes);
      unpacked.resize(exr_pixel_bytes(part) * chunk.width * chunk.height);
      if (!state_->source.read(chunk.offset, packed) || !exr_unpack(part, chunk, packed, unpacked))
        return fail(Code::file_damaged, name(), exr_place(part, chunk), "cannot be decoded");
      copy_chunk(part, chunk, unpacked, first, pixels);
    }
    return pixels;
  } catch (const std::bad_alloc&) {
    return refused(Code::file_too_large, "out of memory");
  }
}

}  // namespace selvedge
