#include "format/exr.h"

#include <Imath/half.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfTiledInputPart.h>
#include <OpenEXR/ImfTiledOutputPart.h>
#include <OpenEXR/ImfVecAttribute.h>
#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <utility>

#include "format/atomic_file.h"
#include "format/exr_layout.h"
#include "format/exr_source.h"
#include "format/fabric.h"

namespace selvedge {
namespace {

constexpr float largest_half = 65504.0F;

Imf::PixelType pixel_type(const ExrChannel& channel) { return channel.half ? Imf::HALF : Imf::FLOAT; }

/// The part with all that the writer may choose: one tile per level where it fits, 32 to 64 pixels a side.
ExrPart completed(ExrPart part) {
  part.tiled = part.tiled || part.mipmapped;
  part.levels = part.mipmapped ? level_count(part.width, part.height) : 1;
  const int side = std::max(part.width, part.height) > 32 ? 64 : 32;
  if (part.tile_width == 0) part.tile_width = side;
  if (part.tile_height == 0) part.tile_height = side;
  return part;
}

/// `display` is the first part's: OpenEXR wants one display window in the whole file.
Imf::Header header_of(const ExrPart& part, const ExrPart& display) {
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

std::map<std::string, ExrValue> attributes_of(const Imf::Header& header) {
  std::map<std::string, ExrValue> result;
  for (auto i = header.begin(); i != header.end(); ++i) {
    const Imf::Attribute& a = i.attribute();
    if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&a)) result[i.name()] = text->value();
    if (const auto* whole = dynamic_cast<const Imf::IntAttribute*>(&a)) result[i.name()] = whole->value();
    if (const auto* real = dynamic_cast<const Imf::FloatAttribute*>(&a)) result[i.name()] = real->value();
    if (const auto* v2 = dynamic_cast<const Imf::V2fAttribute*>(&a)) result[i.name()] = v2->value();
    if (const auto* v3 = dynamic_cast<const Imf::V3fAttribute*>(&a)) result[i.name()] = v3->value();
  }
  return result;
}

/// A slice over one plane whose first row is scanline `first_row`.
Imf::Slice slice_of(Imf::PixelType type, const void* plane, int width, int first_row, std::size_t size) {
  const std::size_t row_bytes = size * static_cast<std::size_t>(width);
  // OpenEXR addresses by absolute scanline: the base lies `first_row` rows before the buffer.
  auto* base = reinterpret_cast<char*>(reinterpret_cast<std::uintptr_t>(plane) -
                                       static_cast<std::uintptr_t>(first_row) * row_bytes);
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
        if (std::abs(plane[i]) > largest_half || std::isnan(plane[i])) {
          const auto width = static_cast<std::size_t>(pixels.width);
          return fail(
              Code::fabric_not_finite, file,
              fmt::format("{}/{}/pixel {},{}", part.name, part.channels[c].name, i % width, i / width),
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

class SourceStream : public Imf::IStream {
 public:
  SourceStream(ExrSource& source, const std::string& name) : IStream(name.c_str()), source_(source) {}
  bool isMemoryMapped() const override { return false; }
  bool read(char c[], int n) override {
    const auto count = static_cast<std::size_t>(n);
    if (!source_.read(position_, {reinterpret_cast<std::uint8_t*>(c), count})) {
      throw Iex::InputExc("unexpected end of file");
    }
    position_ += count;
    return position_ < source_.size();
  }
  std::uint64_t tellg() override { return position_; }
  void seekg(std::uint64_t position) override { position_ = position; }

 private:
  ExrSource& source_;
  std::uint64_t position_ = 0;
};

/// A plain file that remembers a failed write: OpenEXR finishes a file in a destructor, which keeps errors to
/// itself.
class FileStream : public Imf::OStream {
 public:
  FileStream(const std::string& path, const std::string& name)
      : OStream(name.c_str()), file_(std::fopen(path.c_str(), "wb")) {
    if (file_ == nullptr) remember();
  }
  FileStream(const FileStream&) = delete;
  FileStream& operator=(const FileStream&) = delete;
  ~FileStream() override { close(); }

  void write(const char c[], int n) override {
    const auto count = static_cast<std::size_t>(n);
    if (file_ == nullptr || std::fwrite(c, 1, count, file_) != count) fail_now();
  }
  std::uint64_t tellp() override { return file_ == nullptr ? 0 : static_cast<std::uint64_t>(ftello(file_)); }
  void seekp(std::uint64_t position) override {
    if (file_ == nullptr || fseeko(file_, static_cast<off_t>(position), SEEK_SET) != 0) fail_now();
  }
  /// Empty if everything that was ever written has arrived.
  const std::string& close() {
    if (file_ != nullptr && std::fclose(std::exchange(file_, nullptr)) != 0) remember();
    return reason_;
  }

 private:
  void remember() {
    if (reason_.empty()) reason_ = std::strerror(errno);
  }
  [[noreturn]] void fail_now() {
    remember();
    throw Iex::IoExc(reason_);
  }

  std::FILE* file_;
  std::string reason_;
};

}  // namespace

/// In this order: the output is finished before its stream is closed, and that before the temporary file
/// goes.
struct ExrWriter::State {
  AtomicFile file;
  std::vector<ExrPart> parts;
  std::vector<int> next_row;
  std::unique_ptr<FileStream> stream;
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
    part = completed(std::move(part));
    if (!part.tiled && !part.increasing_y) {
      return fail(Code::option_out_of_range, path, part.name, "scanlines are written from the top down");
    }
  }
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected(file.error());
  try {
    std::vector<Imf::Header> headers;
    for (const ExrPart& part : parts) headers.push_back(header_of(part, parts.front()));
    auto stream = std::make_unique<FileStream>(file->temporary(), path);
    auto out =
        std::make_unique<Imf::MultiPartOutputFile>(*stream, headers.data(), static_cast<int>(headers.size()));
    std::vector<int> next_row(parts.size(), 0);
    return ExrWriter(std::make_unique<State>(
        State{std::move(*file), std::move(parts), std::move(next_row), std::move(stream), std::move(out)}));
  } catch (const std::exception& e) {
    return fail(Code::file_unwritable, path, {}, e.what());
  }
}

Result<void> ExrWriter::write_level(int part_index, int level, const ExrPixels& pixels) {
  const ExrPart& part = state_->parts[static_cast<std::size_t>(part_index)];
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
  const ExrPart& part = state_->parts[static_cast<std::size_t>(part_index)];
  int& next_row = state_->next_row[static_cast<std::size_t>(part_index)];
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
  state_->out.reset();
  const std::string& reason = state_->stream->close();
  if (!reason.empty()) return fail(Code::file_unwritable, state_->file.path(), {}, reason);
  return state_->file.commit();
}

struct ExrReader::State {
  std::string name;
  ExrLimits limits;
  ExrSource source;
  std::unique_ptr<SourceStream> stream;
  std::unique_ptr<Imf::MultiPartInputFile> in;
  std::vector<ExrPart> parts;
};

ExrReader::ExrReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
ExrReader::ExrReader(ExrReader&&) noexcept = default;
ExrReader& ExrReader::operator=(ExrReader&&) noexcept = default;
ExrReader::~ExrReader() = default;
const std::string& ExrReader::name() const { return state_->name; }
const std::vector<ExrPart>& ExrReader::parts() const { return state_->parts; }

std::uint64_t ExrReader::bytes_read() const { return state_->source.bytes_read(); }

int ExrReader::find_part(const std::string& part_name) const {
  const auto& parts = state_->parts;
  const auto found =
      std::find_if(parts.begin(), parts.end(), [&](const ExrPart& part) { return part.name == part_name; });
  return found == parts.end() ? -1 : static_cast<int>(found - parts.begin());
}

namespace {

Result<ExrPart> part_of(const Imf::Header& header, const std::string& file, const ExrLimits& limits) {
  ExrPart part;
  part.name = header.hasName() ? header.name() : std::string();
  const std::string& place = part.name;
  const std::string type = header.hasType() ? header.type() : std::string();
  const bool tiled = header.hasTileDescription();
  if (!type.empty() && type != Imf::SCANLINEIMAGE && type != Imf::TILEDIMAGE) {
    return fail(Code::exr_unsupported, file, place, fmt::format("part type '{}' is not read", type));
  }
  const Imath::Box2i& window = header.dataWindow();
  const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1;
  const std::int64_t height = std::int64_t{window.max.y} - window.min.y + 1;
  if (width < 1 || height < 1) return fail(Code::exr_malformed, file, place, "empty data window");
  if (static_cast<std::uint64_t>(width) > limits.pixels_per_part ||
      static_cast<std::uint64_t>(height) > limits.pixels_per_part / static_cast<std::uint64_t>(width)) {
    return fail(Code::file_too_large, file, place, fmt::format("{}x{} pixels", width, height));
  }
  if (window.min.x != 0 || window.min.y != 0) {
    return fail(Code::exr_unsupported, file, place, "the data window does not begin at 0,0");
  }
  part.width = static_cast<int>(width);
  part.height = static_cast<int>(height);
  if (tiled) {
    const Imf::TileDescription& tiles = header.tileDescription();
    if (tiles.mode != Imf::ONE_LEVEL &&
        (tiles.mode != Imf::MIPMAP_LEVELS || tiles.roundingMode != Imf::ROUND_DOWN)) {
      return fail(Code::exr_unsupported, file, place, "levels other than mip maps rounded down are not read");
    }
    part.tiled = true;
    part.mipmapped = tiles.mode == Imf::MIPMAP_LEVELS;
    part.levels = part.mipmapped ? level_count(part.width, part.height) : 1;
    part.tile_width = static_cast<int>(tiles.xSize);
    part.tile_height = static_cast<int>(tiles.ySize);
  }
  part.compression = exr_compressions.at(static_cast<std::size_t>(header.compression())).name;
  part.increasing_y = header.lineOrder() == Imf::INCREASING_Y;
  part.display_is_data = header.displayWindow() == window;
  for (auto c = header.channels().begin(); c != header.channels().end(); ++c) {
    const Imf::Channel& channel = c.channel();
    const std::string where = fmt::format("{}/{}", part.name, c.name());
    if (channel.xSampling != 1 || channel.ySampling != 1) {
      return fail(Code::exr_unsupported, file, where, "sub-sampled channels are not read");
    }
    if (channel.type != Imf::HALF && channel.type != Imf::FLOAT) {
      return fail(Code::exr_unsupported, file, where, "only half and float channels are read");
    }
    part.channels.push_back({c.name(), channel.type == Imf::HALF});
    if (static_cast<int>(part.channels.size()) > limits.channels) {
      return fail(Code::file_too_large, file, place, "too many channels");
    }
  }
  part.attributes = attributes_of(header);
  return part;
}

ExrPixels pixels_for(const ExrPart& part, int width, int height) {
  ExrPixels pixels;
  pixels.width = width;
  pixels.height = height;
  const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  pixels.planes.assign(part.channels.size(), std::vector<float>(count));
  return pixels;
}

Imf::FrameBuffer frame_buffer_of(const ExrPart& part, ExrPixels& pixels, int first_row) {
  Imf::FrameBuffer buffer;
  for (std::size_t c = 0; c < part.channels.size(); ++c) {
    buffer.insert(part.channels[c].name,
                  slice_of(Imf::FLOAT, pixels.planes[c].data(), pixels.width, first_row, sizeof(float)));
  }
  return buffer;
}

/// B44 and DWA are what hostile files have broken most often; no file that Selvedge reads may be lossy.
Result<void> decodable(const ExrPart& part, const std::string& file) {
  if (!is_lossy(part.compression)) return {};
  return fail(Code::exr_unsupported, file, part.name,
              fmt::format("pixels in the lossy compression '{}' are not read", part.compression));
}

}  // namespace

Result<ExrReader> ExrReader::open(const std::string& path, const ExrLimits& limits) {
  auto source = ExrSource::open(path);
  if (!source) return tl::unexpected(source.error());
  return open(std::make_unique<State>(State{path, limits, std::move(*source), {}, {}, {}}));
}

Result<ExrReader> ExrReader::open(std::span<const std::uint8_t> bytes, const std::string& name,
                                  const ExrLimits& limits) {
  return open(std::make_unique<State>(State{name, limits, ExrSource(bytes), {}, {}, {}}));
}

Result<ExrReader> ExrReader::open(std::unique_ptr<State> state) {
  const std::string& name = state->name;
  ExrLimits& limits = state->limits;
  const std::uint64_t file_bytes = state->source.size();
  if (file_bytes < limits.bytes_per_read / std::max<std::uint64_t>(limits.expansion, 1)) {
    limits.bytes_per_read = file_bytes * limits.expansion;
  }
  try {
    state->stream = std::make_unique<SourceStream>(state->source, name);
    state->in = std::make_unique<Imf::MultiPartInputFile>(*state->stream, 1, false);
    if (state->in->parts() > limits.parts) {
      return fail(Code::file_too_large, name, {}, fmt::format("{} parts", state->in->parts()));
    }
    for (int i = 0; i < state->in->parts(); ++i) {
      auto part = part_of(state->in->header(i), name, limits);
      if (!part) return tl::unexpected(part.error());
      state->parts.push_back(std::move(*part));
    }
  } catch (const std::exception& e) {
    return fail(Code::exr_malformed, name, {}, e.what());
  }
  return ExrReader(std::move(state));
}

Result<ExrPixels> ExrReader::read_level(int part_index, int level) {
  const ExrPart& part = state_->parts[static_cast<std::size_t>(part_index)];
  if (!part.tiled) return read_rows(part_index, 0, part.height);
  if (auto ok = decodable(part, state_->name); !ok) return tl::unexpected(ok.error());
  const int width = level_size(part.width, level);
  const int height = level_size(part.height, level);
  const std::uint64_t bytes = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) *
                              part.channels.size() * sizeof(float);
  if (bytes > state_->limits.bytes_per_read) {
    return fail(Code::file_too_large, state_->name, part.name, fmt::format("a level of {} bytes", bytes));
  }
  ExrPixels pixels = pixels_for(part, width, height);
  try {
    Imf::TiledInputPart in(*state_->in, part_index);
    in.setFrameBuffer(frame_buffer_of(part, pixels, 0));
    in.readTiles(0, in.numXTiles(level) - 1, 0, in.numYTiles(level) - 1, level);
  } catch (const std::exception& e) {
    return fail(Code::file_damaged, state_->name, fmt::format("{}/level {}", part.name, level), e.what());
  }
  return pixels;
}

Result<ExrPixels> ExrReader::read_rows(int part_index, int first, int count) {
  const ExrPart& part = state_->parts[static_cast<std::size_t>(part_index)];
  if (auto ok = decodable(part, state_->name); !ok) return tl::unexpected(ok.error());
  const std::uint64_t bytes = static_cast<std::uint64_t>(part.width) * static_cast<std::uint64_t>(count) *
                              part.channels.size() * sizeof(float);
  if (bytes > state_->limits.bytes_per_read) {
    return fail(Code::file_too_large, state_->name, part.name, fmt::format("rows of {} bytes", bytes));
  }
  ExrPixels pixels = pixels_for(part, part.width, count);
  try {
    Imf::InputPart in(*state_->in, part_index);
    in.setFrameBuffer(frame_buffer_of(part, pixels, first));
    in.readPixels(first, first + count - 1);
  } catch (const std::exception& e) {
    return fail(Code::file_damaged, state_->name,
                fmt::format("{}/rows {}-{}", part.name, first, first + count - 1), e.what());
  }
  return pixels;
}

}  // namespace selvedge
