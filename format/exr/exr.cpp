#include "format/exr/exr.h"

#include <Imath/half.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStdIO.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfThreading.h>
#include <OpenEXR/ImfTiledOutputPart.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <utility>

#include "format/base/atomic_file.h"
#include "format/base/parallel.h"
#include "format/exr/size.h"

namespace selvedge {
namespace {

/// `display`: the part with the display window; OpenEXR requires the same one in all parts.
Imf::Header exr_header(const ExrPart& part, const ExrPart& display) {
  Imf::Header header(part.width, part.height);
  header.displayWindow() = Imath::Box2i({0, 0}, {display.width - 1, display.height - 1});
  header.setName(part.name);
  header.setType(part.has_mipmaps ? Imf::TILEDIMAGE : Imf::SCANLINEIMAGE);
  header.compression() = part.is_zipped ? Imf::ZIP_COMPRESSION : Imf::NO_COMPRESSION;
  if (part.has_mipmaps) {
    header.setTileDescription(Imf::TileDescription(static_cast<unsigned>(part.tile_size.x),
                                                   static_cast<unsigned>(part.tile_size.y),
                                                   Imf::MIPMAP_LEVELS, Imf::ROUND_DOWN));
  }
  for (const ExrChannel& channel : part.channels)
    header.channels().insert(channel.name, Imf::Channel(channel.is_half ? Imf::HALF : Imf::FLOAT));
  for (const auto& [name, text] : part.attributes) header.insert(name, Imf::StringAttribute(text));
  return header;
}

/// Planes in their stored precision, and the frame buffer that points at them.
struct StoredPlanes {
  std::vector<std::vector<Imath::half>> halves;
  Imf::FrameBuffer buffer;
};

StoredPlanes stored_planes(const ExrPart& part, const ExrPixels& pixels) {
  StoredPlanes stored;
  stored.halves.resize(part.channels.size());
  const auto insert = [&](const ExrChannel& channel, const void* plane, std::size_t size) {
    auto* const base = const_cast<char*>(static_cast<const char*>(plane));  // OpenEXR only reads it
    const Imf::PixelType type = channel.is_half ? Imf::HALF : Imf::FLOAT;
    stored.buffer.insert(channel.name, Imf::Slice(type, base, size, size * pixels.width));
  };
  for (std::size_t c = 0; c < part.channels.size(); ++c) {
    const std::vector<float>& plane = pixels.planes[c];
    if (!part.channels[c].is_half) {
      insert(part.channels[c], plane.data(), sizeof(float));
      continue;
    }
    std::vector<Imath::half>& halves = stored.halves[c];
    halves.assign(plane.begin(), plane.end());
    insert(part.channels[c], halves.data(), sizeof(Imath::half));
  }
  return stored;
}

}  // namespace

/// Destroyed in reverse order: the output is finished before its stream is closed, and the stream is closed
/// before the temporary file is removed.
struct ExrWriter::State {
  AtomicFile file;
  std::vector<ExrPart> parts;
  std::unique_ptr<std::ofstream> stream;
  std::unique_ptr<Imf::StdOFStream> named_stream;
  std::unique_ptr<Imf::MultiPartOutputFile> out;
};

Result<ExrWriter> ExrWriter::create(const std::string& path, std::vector<ExrPart> parts) {
  for (ExrPart& part : parts) part = exr_with_defaults(std::move(part));
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected(file.error());
  try {
    // Compression takes most of the time of writing; the bytes do not depend on the threads.
    if (Imf::globalThreadCount() != thread_count()) Imf::setGlobalThreadCount(thread_count());
    std::vector<Imf::Header> headers;
    for (const ExrPart& part : parts) headers.push_back(exr_header(part, parts.front()));
    auto stream = std::make_unique<std::ofstream>(file->temporary_path(), std::ios::binary);
    auto named = std::make_unique<Imf::StdOFStream>(*stream, path.c_str());
    auto out =
        std::make_unique<Imf::MultiPartOutputFile>(*named, headers.data(), static_cast<int>(headers.size()));
    return ExrWriter(std::make_shared<State>(
        State{std::move(*file), std::move(parts), std::move(stream), std::move(named), std::move(out)}));
  } catch (const std::exception& e) {
    return fail(Code::file_unwritable, path, {}, e.what());
  }
}

Result<void> ExrWriter::write_level(int part_index, int level, const ExrPixels& pixels) {
  const ExrPart& part = state_->parts[part_index];
  const std::string& file = state_->file.path();
  if (auto sound = check_halves(part, pixels, file); !sound) return sound;
  try {
    const StoredPlanes stored = stored_planes(part, pixels);
    if (part.has_mipmaps) {
      Imf::TiledOutputPart out(*state_->out, part_index);
      out.setFrameBuffer(stored.buffer);
      out.writeTiles(0, out.numXTiles(level) - 1, 0, out.numYTiles(level) - 1, level);
    } else {
      Imf::OutputPart out(*state_->out, part_index);
      out.setFrameBuffer(stored.buffer);
      out.writePixels(pixels.height);
    }
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

}  // namespace selvedge
