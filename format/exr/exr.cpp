#include "format/exr/exr.h"

#include <Imath/half.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStdIO.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfThreading.h>
#include <OpenEXR/ImfTiledInputPart.h>
#include <OpenEXR/ImfTiledOutputPart.h>
#include <OpenEXR/ImfVecAttribute.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <utility>

#include "format/base/atomic_file.h"
#include "format/base/mip.h"
#include "format/base/parallel.h"
#include "format/exr/layout.h"
#include "format/exr/unpack.h"

namespace selvedge {
namespace {

constexpr float max_half = 65504.0F;

Imf::PixelType pixel_type(const ExrChannel& channel) { return channel.half ? Imf::HALF : Imf::FLOAT; }

/// Sets tiles and levels that the caller left open: tiles of 32 x 32 or, for larger parts, 64 x 64 pixels.
ExrPart with_defaults(ExrPart part) {
  part.tiled = part.tiled || part.mipmapped;
  part.levels = part.mipmapped ? level_count(part.width, part.height) : 1;
  const int side = std::max(part.width, part.height) > 32 ? 64 : 32;
  if (part.tile_width == 0) part.tile_width = side;
  if (part.tile_height == 0) part.tile_height = side;
  return part;
}

/// `display`: the part with the display window; OpenEXR requires the same one in all parts.
Imf::Header exr_header(const ExrPart& part, const ExrPart& display) {
  Imf::Header header(part.width, part.height);
  header.displayWindow() = Imath::Box2i({0, 0}, {display.width - 1, display.height - 1});
  header.setName(part.name);
  header.setType(part.tiled ? Imf::TILEDIMAGE : Imf::SCANLINEIMAGE);
  header.compression() = static_cast<Imf::Compression>(exr_compression_index(part.compression));
  header.lineOrder() = part.increasing_y ? Imf::INCREASING_Y : Imf::DECREASING_Y;
  if (part.tiled) {
    header.setTileDescription(
        Imf::TileDescription(static_cast<unsigned>(part.tile_width), static_cast<unsigned>(part.tile_height),
                             part.mipmapped ? Imf::MIPMAP_LEVELS : Imf::ONE_LEVEL, Imf::ROUND_DOWN));
  }
  for (const ExrChannel& channel : part.channels) {
    header.channels().insert(channel.name, Imf::Channel(pixel_type(channel)));
  }
  for (const auto& [name, value] : part.attributes) {
    if (const auto* text = std::get_if<std::string>(&value)) {
      header.insert(name, Imf::StringAttribute(*text));
    } else if (const auto* whole = std::get_if<int>(&value)) {
      header.insert(name, Imf::IntAttribute(*whole));
    } else if (const auto* real = std::get_if<float>(&value)) {
      header.insert(name, Imf::FloatAttribute(*real));
    } else if (const auto* v2 = std::get_if<V2f>(&value)) {
      header.insert(name, Imf::V2fAttribute(*v2));
    } else if (const auto* v3 = std::get_if<V3f>(&value)) {
      header.insert(name, Imf::V3fAttribute(*v3));
    }
  }
  return header;
}

/// A slice over one plane whose first row is scanline `first_row`.
Imf::Slice slice_of(Imf::PixelType type, const void* plane, int width, int first_row, std::size_t size) {
  const std::size_t row_bytes = size * width;
  // OpenEXR addresses by absolute scanline: the base is `first_row` rows before the buffer.
  auto* base = reinterpret_cast<char*>(reinterpret_cast<std::uintptr_t>(plane) - first_row * row_bytes);
  return {type, base, size, row_bytes};
}

/// Planes in their stored precision, and the frame buffer that points at them.
struct StoredPlanes {
  std::vector<std::vector<Imath::half>> halves;
  Imf::FrameBuffer buffer;
};

Result<StoredPlanes> stored_planes(const ExrPart& part, const ExrPixels& pixels, int first_row,
                                   const std::string& file) {
  StoredPlanes stored;
  stored.halves.resize(part.channels.size());
  for (std::size_t c = 0; c < part.channels.size(); ++c) {
    const std::vector<float>& plane = pixels.planes[c];
    if (part.channels[c].half) {
      stored.halves[c].resize(plane.size());
      for (std::size_t i = 0; i < plane.size(); ++i) {
        if (std::abs(plane[i]) > max_half || std::isnan(plane[i])) {
          return fail(Code::fabric_not_finite, file,
                      fmt::format("{}/{}/pixel {},{}", part.name, part.channels[c].name, i % pixels.width,
                                  i / pixels.width),
                      fmt::format("{} does not fit into half precision", plane[i]));
        }
        stored.halves[c][i] = Imath::half(plane[i]);
      }
      stored.buffer.insert(part.channels[c].name, slice_of(Imf::HALF, stored.halves[c].data(), pixels.width,
                                                           first_row, sizeof(Imath::half)));
    } else {
      stored.buffer.insert(part.channels[c].name,
                           slice_of(Imf::FLOAT, plane.data(), pixels.width, first_row, sizeof(float)));
    }
  }
  return stored;
}

}  // namespace

/// Destroyed in reverse order: the output is finished before its stream is closed, and the stream is closed
/// before the temporary file is removed.
struct ExrWriter::State {
  AtomicFile file;
  std::vector<ExrPart> parts;
  std::vector<int> next_row;
  std::unique_ptr<std::ofstream> stream;
  std::unique_ptr<Imf::StdOFStream> named_stream;
  std::unique_ptr<Imf::MultiPartOutputFile> out;
};

ExrWriter::ExrWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
ExrWriter::ExrWriter(ExrWriter&&) noexcept = default;
ExrWriter& ExrWriter::operator=(ExrWriter&&) noexcept = default;
ExrWriter::~ExrWriter() = default;

Result<ExrWriter> ExrWriter::create(const std::string& path, std::vector<ExrPart> parts) {
  for (ExrPart& part : parts) {
    if (exr_compression_index(part.compression) < 0 || is_lossy(part.compression)) {
      return fail(Code::option_out_of_range, path, part.name,
                  fmt::format("compression '{}' is lossy or unknown", part.compression));
    }
    part = with_defaults(std::move(part));
    if (!part.tiled && !part.increasing_y) {
      return fail(Code::option_out_of_range, path, part.name, "scanlines are written from the top down");
    }
  }
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected(file.error());
  try {
    // Compression takes most of the time of writing; the bytes do not depend on the threads.
    if (Imf::globalThreadCount() != thread_count()) Imf::setGlobalThreadCount(thread_count());
    std::vector<Imf::Header> headers;
    for (const ExrPart& part : parts) headers.push_back(exr_header(part, parts.front()));
    auto stream = std::make_unique<std::ofstream>(file->temporary(), std::ios::binary);
    auto named = std::make_unique<Imf::StdOFStream>(*stream, path.c_str());
    auto out =
        std::make_unique<Imf::MultiPartOutputFile>(*named, headers.data(), static_cast<int>(headers.size()));
    std::vector<int> next_row(parts.size(), 0);
    return ExrWriter(std::make_unique<State>(State{std::move(*file), std::move(parts), std::move(next_row),
                                                   std::move(stream), std::move(named), std::move(out)}));
  } catch (const std::exception& e) {
    return fail(Code::file_unwritable, path, {}, e.what());
  }
}

Result<void> ExrWriter::write_level(int part_index, int level, const ExrPixels& pixels) {
  const ExrPart& part = state_->parts[part_index];
  if (!part.tiled) return write_rows(part_index, pixels);
  const std::string& file = state_->file.path();
  const auto stored = stored_planes(part, pixels, 0, file);
  if (!stored) return tl::unexpected(stored.error());
  try {
    Imf::TiledOutputPart out(*state_->out, part_index);
    out.setFrameBuffer(stored->buffer);
    out.writeTiles(0, out.numXTiles(level) - 1, 0, out.numYTiles(level) - 1, level);
  } catch (const std::exception& e) {
    return fail(Code::file_unwritable, file, part.name, e.what());
  }
  return {};
}

Result<void> ExrWriter::write_rows(int part_index, const ExrPixels& pixels) {
  const ExrPart& part = state_->parts[part_index];
  int& next_row = state_->next_row[part_index];
  const std::string& file = state_->file.path();
  const auto stored = stored_planes(part, pixels, next_row, file);
  if (!stored) return tl::unexpected(stored.error());
  try {
    Imf::OutputPart out(*state_->out, part_index);
    out.setFrameBuffer(stored->buffer);
    out.writePixels(pixels.height);
    next_row += pixels.height;
  } catch (const std::exception& e) {
    return fail(Code::file_unwritable, file, part.name, e.what());
  }
  return {};
}

Result<void> ExrWriter::commit() {
  // OpenEXR finishes a file in a destructor, which cannot report errors; the stream's state shows them.
  state_->out.reset();
  state_->stream->close();
  if (!*state_->stream) return fail(Code::file_unwritable, state_->file.path(), {}, std::strerror(errno));
  return state_->file.commit();
}

namespace {

template <class T>
void write_number(Imf::OStream& file, T value) {
  std::array<char, sizeof(T)> bytes{};
  for (std::size_t i = 0; i < sizeof(T); ++i) bytes.at(i) = static_cast<char>(value >> (8 * i) & 0xFF);
  file.write(bytes.data(), sizeof(T));
}

}  // namespace

bool exr_unpack_piz(const ExrPart& part, const ExrChunk& chunk, std::span<const std::uint8_t> packed,
                    std::span<std::uint8_t> pixels) {
  if (pixels.size() > std::size_t{1} << 30) return false;  // OpenEXR counts in int
  ExrPart single_tile;
  single_tile.tiled = true;
  single_tile.width = single_tile.tile_width = chunk.width;
  single_tile.height = single_tile.tile_height = chunk.height;
  single_tile.compression = "piz";
  single_tile.channels = part.channels;
  try {
    Imf::StdOSStream file;
    write_number<std::uint32_t>(file, 20000630);
    write_number<std::uint32_t>(file, 2 | 0x200 | 0x400);  // version 2, tiled, long names
    exr_header(single_tile, single_tile).writeTo(file, true);
    write_number<std::uint64_t>(file, file.tellp() + 8);
    for (int i = 0; i < 4; ++i) write_number<std::uint32_t>(file, 0);  // tile 0,0 of level 0,0
    write_number<std::uint32_t>(file, static_cast<std::uint32_t>(packed.size()));
    file.write(reinterpret_cast<const char*>(packed.data()), static_cast<int>(packed.size()));

    Imf::StdISStream input;
    input.str(file.str());
    Imf::MultiPartInputFile in(input, 0, false);
    Imf::FrameBuffer buffer;
    const std::size_t row_bytes = exr_pixel_bytes(part) * chunk.width;
    std::size_t offset = 0;
    for (const ExrChannel& channel : part.channels) {
      const std::size_t size = channel.half ? 2 : 4;
      buffer.insert(
          channel.name,
          Imf::Slice(pixel_type(channel), reinterpret_cast<char*>(pixels.data()) + offset, size, row_bytes));
      offset += size * chunk.width;
    }
    Imf::TiledInputPart tile(in, 0);
    tile.setFrameBuffer(buffer);
    tile.readTile(0, 0);
  } catch (const std::exception&) {
    return false;
  }
  return true;
}

}  // namespace selvedge
