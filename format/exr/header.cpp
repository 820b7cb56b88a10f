#include <Imath/ImathBox.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "format/base/mip.h"
#include "format/base/printable.h"
#include "format/exr/bytes.h"
#include "format/exr/scan.h"

namespace selvedge {
namespace {

using Imath::Box2i;

/// Thrown and caught within this file only.
struct Refusal {
  Code code;
  std::string place;
  std::string message;
};

[[noreturn]] void malformed(std::string place, std::string message) {
  throw Refusal{Code::exr_malformed, std::move(place), std::move(message)};
}

[[noreturn]] void unsupported(std::string place, std::string message) {
  throw Refusal{Code::exr_unsupported, std::move(place), std::move(message)};
}

/// Whether a name is UTF-8 without control characters.
bool is_printable(const std::string& name) {
  return printable(name) == name && name.find_first_of("\n\t") == std::string::npos;
}

/// Reads the beginning of the file on demand, up to a limit.
class HeaderReader {
 public:
  HeaderReader(const InputFile& source, const ExrLimits& limits)
      : source_(source), limit_(limits.header_bytes) {}

  std::uint64_t position() const { return position_; }
  std::span<const std::uint8_t> read(std::uint64_t count) {
    fetch(count);
    const auto from = bytes_.begin() + static_cast<std::ptrdiff_t>(position_);
    position_ += count;
    return {from, count};
  }
  std::uint8_t peek() {
    fetch(1);
    return bytes_[position_];
  }
  /// A text that ends with a zero byte, of at most `max_size` bytes.
  std::string text(std::size_t max_size, const std::string& place) {
    std::string result;
    for (char c = next(); c != '\0'; c = next()) {
      if (result.size() == max_size)
        malformed(place, fmt::format("a name is longer than {} bytes", max_size));
      result += c;
    }
    if (!is_printable(result)) malformed(place, "a name is not printable UTF-8");
    return result;
  }

 private:
  char next() { return static_cast<char>(read(1)[0]); }
  void fetch(std::uint64_t count) {
    const std::uint64_t left = source_.size() - position_;
    if (count > left) throw Refusal{Code::file_damaged, {}, "ends within its header"};
    if (position_ + count > limit_)
      throw Refusal{Code::file_too_large, {}, fmt::format("a header of more than {} bytes", limit_)};
    if (position_ + count <= bytes_.size()) return;
    const std::uint64_t block = std::max<std::uint64_t>(4096, bytes_.size() / 4);
    const std::size_t have = bytes_.size();
    bytes_.resize(std::min(source_.size(), std::max(position_ + count, std::uint64_t{have} + block)));
    if (!source_.read(have, std::span(bytes_).subspan(have)))
      throw Refusal{Code::file_unreadable, {}, "cannot be read"};
  }

  const InputFile& source_;
  std::uint64_t limit_;
  std::vector<std::uint8_t> bytes_;
  std::uint64_t position_ = 0;
};

struct Attribute {
  std::string type;
  std::vector<std::uint8_t> value;
};

using Attributes = std::map<std::string, Attribute>;

/// Size of a value of this type; -1 if values differ in size.
int size_of_type(std::string_view type) {
  static const std::map<int, std::set<std::string_view>> types{
      {1, {"compression", "deepImageState", "envmap", "lineOrder"}},
      {4, {"float", "int"}},
      {8, {"double", "rational", "timecode", "v2f", "v2i"}},
      {9, {"tiledesc"}},
      {12, {"v3f", "v3i"}},
      {16, {"box2f", "box2i", "v2d"}},
      {24, {"v3d"}},
      {28, {"keycode"}},
      {32, {"chromaticities"}},
      {36, {"m33f"}},
      {64, {"m44f"}},
      {72, {"m33d"}},
      {128, {"m44d"}},
  };
  for (const auto& [bytes, names] : types) {
    if (names.contains(type)) return bytes;
  }
  return -1;
}

struct StandardAttribute {
  const char* name;
  const char* type;
  bool required;  ///< in every file
};

constexpr std::array<StandardAttribute, 12> standard_attributes{{
    {"channels", "chlist", true},
    {"compression", "compression", true},
    {"dataWindow", "box2i", true},
    {"displayWindow", "box2i", true},
    {"lineOrder", "lineOrder", true},
    {"pixelAspectRatio", "float", true},
    {"screenWindowCenter", "v2f", true},
    {"screenWindowWidth", "float", true},
    {"chunkCount", "int", false},
    {"name", "string", false},
    {"tiles", "tiledesc", false},
    {"type", "string", false},
}};

Attributes read_attributes(HeaderReader& reader, std::size_t max_name_size, const std::string& place,
                           const ExrLimits& limits) {
  Attributes attributes;
  for (std::string name = reader.text(max_name_size, place); !name.empty();
       name = reader.text(max_name_size, place)) {
    Attribute attribute;
    attribute.type = reader.text(max_name_size, place);
    const std::int32_t size = ExrBytes(reader.read(4)).i32();
    if (size < 0) malformed(place, fmt::format("attribute '{}' has a negative size", name));
    const auto bytes = reader.read(size);
    attribute.value.assign(bytes.begin(), bytes.end());
    if (const int known = size_of_type(attribute.type); known >= 0 && known != size) {
      malformed(place, fmt::format("attribute '{}' of type {} has {} bytes instead of {}", name,
                                   attribute.type, size, known));
    }
    if (!attributes.emplace(name, std::move(attribute)).second)
      malformed(place, fmt::format("attribute '{}' is there twice", name));
    if (std::ssize(attributes) > limits.attributes)
      throw Refusal{Code::file_too_large, place, fmt::format("more than {} attributes", limits.attributes)};
  }
  for (const StandardAttribute& standard : standard_attributes) {
    const auto found = attributes.find(standard.name);
    if (found == attributes.end()) {
      if (standard.required) malformed(place, fmt::format("attribute '{}' is missing", standard.name));
    } else if (found->second.type != standard.type) {
      malformed(place, fmt::format("attribute '{}' is of type {} instead of {}", standard.name,
                                   found->second.type, standard.type));
    }
  }
  return attributes;
}

ExrBytes value_of(const Attributes& attributes, const char* name) {
  return ExrBytes(attributes.at(name).value);
}

std::string string_value(const Attribute& attribute) {
  return {attribute.value.begin(), attribute.value.end()};
}

Box2i window_of(const Attributes& attributes, const char* name, const std::string& place) {
  ExrBytes value = value_of(attributes, name);
  Box2i window{V2i{value.i32(), value.i32()}, V2i{value.i32(), value.i32()}};
  // Within half the range of 32 bits, as OpenEXR requires: sizes cannot overflow.
  constexpr std::int32_t limit = std::numeric_limits<std::int32_t>::max() / 2;
  for (const std::int32_t side : {window.min.x, window.min.y, window.max.x, window.max.y}) {
    if (side < -limit || side > limit) malformed(place, fmt::format("{}: out of range", name));
  }
  if (window.max.x < window.min.x || window.max.y < window.min.y)
    malformed(place, fmt::format("{}: is empty", name));
  return window;
}

std::vector<ExrChannel> channels_of(const Attributes& attributes, std::size_t max_name_size,
                                    const std::string& part, const ExrLimits& limits) {
  std::vector<ExrChannel> channels;
  const std::vector<std::uint8_t>& list = attributes.at("channels").value;
  for (auto at = list.begin();;) {
    const auto end = std::find(at, list.end(), std::uint8_t{0});
    if (end == list.end()) malformed(part, "the list of channels has no end");
    const std::string name(at, end);
    at = end + 1;
    if (name.empty()) {
      if (at != list.end()) malformed(part, "the list of channels ends before its attribute does");
      break;
    }
    if (!is_printable(name) || name.size() > max_name_size)
      malformed(part, "a channel's name is too long or not printable UTF-8");
    const std::string place = exr_place(part, name);
    if (list.end() - at < 16) malformed(place, "the channel is cut short");
    ExrBytes entry{std::span(list).subspan(at - list.begin(), 16)};
    at += 16;
    const std::uint32_t type = entry.u32();
    entry.u32();  // a hint for lossy compression, and three reserved bytes
    const std::int32_t across = entry.i32();
    const std::int32_t down = entry.i32();
    if (type > 2) malformed(place, fmt::format("pixel type {}", type));
    if (across < 1 || down < 1) malformed(place, "a sampling rate below 1");
    if (across != 1 || down != 1) unsupported(place, "sub-sampled channels are not read");
    if (type == 0) unsupported(place, "only half and float channels are read");
    // Pixels are in the order of the names, so that channels out of order would be ambiguous.
    if (!channels.empty() && channels.back().name >= name) malformed(place, "channels are not in order");
    if (std::ssize(channels) == limits.channels)
      throw Refusal{Code::file_too_large, part, "too many channels"};
    channels.push_back({name, type == 1});
  }
  if (channels.empty()) malformed(part, "no channels");
  return channels;
}

void read_tiles(const Attributes& attributes, ExrPart& part) {
  ExrBytes value = value_of(attributes, "tiles");
  const std::int32_t width = value.i32();
  const std::int32_t height = value.i32();
  const unsigned mode = value.byte();
  if (width < 1 || height < 1) malformed(part.name, "tiles of no size");
  if ((mode & 15U) > 2 || (mode >> 4U) > 1) malformed(part.name, fmt::format("tile mode {}", mode));
  part.tiled = true;
  part.tile_width = width;
  part.tile_height = height;
  part.mipmapped = (mode & 15U) == 1;
  if ((mode & 15U) == 2 || (part.mipmapped && mode >> 4U != 0))
    unsupported(part.name, "levels other than mip maps rounded down are not read");
  part.levels = part.mipmapped ? level_count(part.width, part.height) : 1;
}

std::map<std::string, ExrValue> user_values(Attributes attributes) {
  for (const StandardAttribute& standard : standard_attributes) attributes.erase(standard.name);
  std::map<std::string, ExrValue> values;
  for (const auto& [name, attribute] : attributes) {
    ExrBytes value(attribute.value);
    if (attribute.type == "string") values[name] = string_value(attribute);
    if (attribute.type == "int") values[name] = value.i32();
    if (attribute.type == "float") values[name] = value.f32();
    if (attribute.type == "v2f") values[name] = V2f{value.f32(), value.f32()};
    if (attribute.type == "v3f") values[name] = V3f{value.f32(), value.f32(), value.f32()};
  }
  return values;
}

/// Flags in the file's version field.
struct FileFlags {
  bool tiled = false;  ///< the file has one part, which is tiled
  bool multipart = false;
  std::size_t max_name_size = 31;
};

FileFlags read_version(HeaderReader& reader) {
  ExrBytes start(reader.read(8));
  if (start.u32() != 20000630) malformed({}, "is not an OpenEXR file");
  const std::uint32_t version = start.u32();
  if ((version & 0xFFU) != 2) unsupported({}, fmt::format("OpenEXR version {}", version & 0xFFU));
  if ((version & 0x800U) != 0) unsupported({}, "deep data is not read");
  if ((version & ~0x16FFU) != 0) unsupported({}, "a feature of a later version of OpenEXR");
  FileFlags flags;
  flags.tiled = (version & 0x200U) != 0;
  flags.multipart = (version & 0x1000U) != 0;
  if (flags.tiled && flags.multipart) malformed({}, "is marked as tiled and as of several parts");
  if ((version & 0x400U) != 0) flags.max_name_size = 255;
  return flags;
}

/// Whether the part is tiled, by up to three places in the file.
bool is_tiled(const Attributes& attributes, const FileFlags& flags, const std::string& place) {
  const auto type = attributes.find("type");
  bool tiled = flags.tiled;
  if (type != attributes.end()) {
    const std::string text = string_value(type->second);
    tiled = text == "tiledimage";
    if (!tiled && text != "scanlineimage") {
      unsupported(place, is_printable(text) ? fmt::format("parts of type '{}' are not read", text)
                                            : "a part of unknown type");
    }
    if (!flags.multipart && tiled != flags.tiled) malformed(place, "type and version of the file differ");
  } else if (flags.multipart) {
    malformed(place, "attribute 'type' is missing");
  }
  if (tiled && !attributes.contains("tiles")) malformed(place, "attribute 'tiles' is missing");
  return tiled;
}

struct ScannedPart {
  ExrPart part;
  Box2i display;
  float pixel_aspect = 1;
};

ScannedPart read_part(HeaderReader& reader, const FileFlags& flags, std::size_t index,
                      const ExrLimits& limits) {
  ScannedPart scanned;
  ExrPart& part = scanned.part;
  const std::string unnamed = flags.multipart ? fmt::format("part {}", index) : std::string();
  const Attributes attributes = read_attributes(reader, flags.max_name_size, unnamed, limits);
  if (const auto name = attributes.find("name"); name != attributes.end())
    part.name = string_value(name->second);
  if (!is_printable(part.name) || (flags.multipart && part.name.empty()))
    malformed(unnamed, "the part has no printable name");
  const std::string& place = part.name;
  const bool tiled = is_tiled(attributes, flags, place);

  const unsigned compression = value_of(attributes, "compression").byte();
  if (compression >= exr_compressions.size())
    unsupported(place, fmt::format("unknown compression {}", compression));
  part.compression = exr_compressions.at(compression).name;
  const unsigned order = value_of(attributes, "lineOrder").byte();
  if (order > (tiled ? 2U : 1U)) malformed(place, fmt::format("line order {}", order));
  part.increasing_y = order == 0;
  scanned.pixel_aspect = value_of(attributes, "pixelAspectRatio").f32();
  if (!(scanned.pixel_aspect >= 1e-6F && scanned.pixel_aspect <= 1e6F))
    malformed(place, "pixelAspectRatio: out of range");
  const float screen = value_of(attributes, "screenWindowWidth").f32();
  if (!(screen >= 0 && std::isfinite(screen))) malformed(place, "screenWindowWidth: out of range");

  const Box2i data = window_of(attributes, "dataWindow", place);
  scanned.display = window_of(attributes, "displayWindow", place);
  part.display_is_data = scanned.display == data;
  const std::uint64_t width = std::int64_t{data.max.x} - data.min.x + 1;
  const std::uint64_t height = std::int64_t{data.max.y} - data.min.y + 1;
  if (width > limits.pixels_per_part || height > limits.pixels_per_part / width)
    throw Refusal{Code::file_too_large, place, fmt::format("{}x{} pixels", width, height)};
  if (data.min != V2i(0, 0)) unsupported(place, "the data window does not begin at 0,0");
  part.width = static_cast<int>(width);
  part.height = static_cast<int>(height);
  if (tiled) read_tiles(attributes, part);
  part.channels = channels_of(attributes, flags.max_name_size, part.name, limits);
  part.attributes = user_values(attributes);

  if (const auto count = attributes.find("chunkCount"); count != attributes.end()) {
    const std::int32_t stored = ExrBytes(count->second.value).i32();
    if (std::cmp_not_equal(stored, exr_chunk_count(part)))
      malformed(place, fmt::format("chunkCount is {} instead of {}", stored, exr_chunk_count(part)));
  } else if (flags.multipart) {
    malformed(place, "attribute 'chunkCount' is missing");
  }
  return scanned;
}

ExrHeader read_all(const InputFile& source, const ExrLimits& limits) {
  if (source.size() < 8) malformed({}, "is not an OpenEXR file");
  HeaderReader reader(source, limits);
  const FileFlags flags = read_version(reader);
  ExrHeader header;
  header.multipart = flags.multipart;
  Box2i display;
  float pixel_aspect = 1;
  do {
    if (std::ssize(header.parts) == limits.parts)
      throw Refusal{Code::file_too_large, {}, fmt::format("more than {} parts", limits.parts)};
    ScannedPart scanned = read_part(reader, flags, header.parts.size(), limits);
    const std::string& name = scanned.part.name;
    if (header.parts.empty()) {
      display = scanned.display;
      pixel_aspect = scanned.pixel_aspect;
    } else if (display != scanned.display || pixel_aspect != scanned.pixel_aspect) {
      malformed(name, "displayWindow or pixelAspectRatio differ from the first part's");
    }
    for (const ExrPart& other : header.parts) {
      if (other.name == name) malformed(name, "two parts have this name");
    }
    header.parts.push_back(std::move(scanned.part));
  } while (flags.multipart && reader.peek() != 0);
  if (flags.multipart) reader.read(1);
  header.end = reader.position();
  return header;
}

}  // namespace

Result<ExrHeader> read_exr_header(const InputFile& source, const std::string& file, const ExrLimits& limits) {
  try {
    return read_all(source, limits);
  } catch (Refusal& refusal) {
    return fail(refusal.code, file, std::move(refusal.place), std::move(refusal.message));
  }
}

}  // namespace selvedge
