#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "format/base/foreign.h"
#include "format/base/mip.h"
#include "format/base/printable.h"
#include "format/exr/bytes.h"
#include "format/exr/layout.h"

namespace selvedge {
namespace {

[[noreturn]] void malformed(std::string place, std::string message) {
  throw_exr_failure(Code::exr_malformed, std::move(place), std::move(message));
}

[[noreturn]] void unsupported(std::string place, std::string message) {
  throw_exr_failure(Code::exr_unsupported, std::move(place), std::move(message));
}

/// Whether a name is UTF-8 without control characters.
bool is_printable(const std::string& name) {
  return escape_unprintable(name) == name && name.find_first_of("\n\t") == std::string::npos;
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
    return {from, static_cast<std::size_t>(count)};
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
    if (count > left) throw_exr_failure(Code::file_damaged, {}, "ends within its header");
    if (position_ + count > limit_)
      throw_exr_failure(Code::file_too_large, {}, fmt::format("a header of more than {} bytes", limit_));
    if (position_ + count <= bytes_.size()) return;
    const std::uint64_t block = std::max<std::uint64_t>(4096, bytes_.size() / 4);
    const std::size_t have = bytes_.size();
    bytes_.resize(std::min(source_.size(), std::max(position_ + count, std::uint64_t{have} + block)));
    if (!source_.read(have, std::span(bytes_).subspan(have)))
      throw_exr_failure(Code::file_unreadable, {}, "cannot be read");
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

struct StandardAttribute {
  const char* name;
  const char* type;
  int bytes;  ///< -1: any number
  bool required;
};

constexpr std::array<StandardAttribute, 12> standard_attributes{{
    {"name", "string", -1, true},
    {"type", "string", -1, true},
    {"channels", "chlist", -1, true},
    {"compression", "compression", 1, true},
    {"dataWindow", "box2i", 16, true},
    {"lineOrder", "lineOrder", 1, true},
    {"chunkCount", "int", 4, true},
    {"tiles", "tiledesc", 9, false},
    {"displayWindow", "box2i", 16, false},
    {"pixelAspectRatio", "float", 4, false},
    {"screenWindowCenter", "v2f", 8, false},
    {"screenWindowWidth", "float", 4, false},
}};

Attributes read_attributes(HeaderReader& reader, std::size_t max_name_size, const std::string& place,
                           const ExrLimits& limits) {
  Attributes attributes;
  for (std::string name = reader.text(max_name_size, place); !name.empty();
       name = reader.text(max_name_size, place)) {
    Attribute attribute;
    attribute.type = reader.text(max_name_size, place);
    const std::int32_t size = ExrByteReader(reader.read(4)).i32();
    if (size < 0) malformed(place, fmt::format("attribute '{}' has a negative size", name));
    const auto bytes = reader.read(size);
    attribute.value.assign(bytes.begin(), bytes.end());
    if (!attributes.emplace(name, std::move(attribute)).second)
      malformed(place, fmt::format("duplicate attribute '{}'", name));
    if (std::ssize(attributes) > limits.attributes)
      throw_exr_failure(Code::file_too_large, place,
                        fmt::format("more than {} attributes", limits.attributes));
  }
  for (const StandardAttribute& standard : standard_attributes) {
    const auto found = attributes.find(standard.name);
    if (found == attributes.end()) {
      if (standard.required) malformed(place, fmt::format("attribute '{}' is missing", standard.name));
      continue;
    }
    const auto& [type, value] = found->second;
    if (type != standard.type || (standard.bytes >= 0 && std::ssize(value) != standard.bytes))
      malformed(place,
                fmt::format("attribute '{}' is of type {} with {} bytes", standard.name, type, value.size()));
  }
  return attributes;
}

ExrByteReader value_of(const Attributes& attributes, const char* name) {
  return ExrByteReader(attributes.at(name).value);
}

std::string text_of(const Attribute& attribute) { return {attribute.value.begin(), attribute.value.end()}; }

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
    ExrByteReader entry{std::span(list).subspan(at - list.begin(), 16)};
    at += 16;
    const std::uint32_t type = entry.u32();
    entry.u32();  // a hint for lossy compression, and three reserved bytes
    const bool sampled = entry.i32() == 1 && entry.i32() == 1;
    if (type != 1 && type != 2) unsupported(place, "only half and float channels are read");
    if (!sampled) unsupported(place, "sub-sampled channels are not read");
    // Pixels are in the order of the names, so that channels out of order would be ambiguous.
    if (!channels.empty() && channels.back().name >= name) malformed(place, "channels are not in order");
    if (std::ssize(channels) == limits.channels)
      throw_exr_failure(Code::file_too_large, part, "too many channels");
    channels.push_back({name, type == 1});
  }
  if (channels.empty()) malformed(part, "no channels");
  return channels;
}

void read_window(const Attributes& attributes, const ExrLimits& limits, ExrPart& part) {
  ExrByteReader window = value_of(attributes, "dataWindow");
  const bool at_origin = window.i32() == 0 && window.i32() == 0;
  const std::int64_t width = std::int64_t{window.i32()} + 1;
  const std::int64_t height = std::int64_t{window.i32()} + 1;
  if (!at_origin) unsupported(part.name, "the data window does not begin at 0,0");
  if (width < 1 || height < 1) malformed(part.name, "the data window is empty");
  if (std::cmp_greater(width, limits.pixels_per_part / static_cast<std::uint64_t>(height)))
    throw_exr_failure(Code::file_too_large, part.name, fmt::format("{}x{} pixels", width, height));
  part.width = static_cast<int>(width);
  part.height = static_cast<int>(height);
}

void read_tiles(const Attributes& attributes, ExrPart& part) {
  if (!attributes.contains("tiles")) malformed(part.name, "attribute 'tiles' is missing");
  ExrByteReader value = value_of(attributes, "tiles");
  part.tile_size = {value.i32(), value.i32()};
  if (part.tile_size.x < 1 || part.tile_size.y < 1) malformed(part.name, "the tiles have no size");
  if (value.byte() != 1) unsupported(part.name, "only tiles of mip levels, rounded down, are read");
  part.has_mipmaps = true;
  part.levels = level_count(part.width, part.height);
}

ExrPart read_part(HeaderReader& reader, std::size_t max_name_size, std::size_t index,
                  const ExrLimits& limits) {
  ExrPart part;
  const std::string unnamed = fmt::format("part {}", index);
  Attributes attributes = read_attributes(reader, max_name_size, unnamed, limits);
  part.name = text_of(attributes.at("name"));
  if (part.name.empty() || !is_printable(part.name)) malformed(unnamed, "the part has no printable name");
  const std::string type = text_of(attributes.at("type"));
  if (type != "tiledimage" && type != "scanlineimage")
    unsupported(part.name, fmt::format("parts of type '{}' are not read", escape_unprintable(type)));
  const unsigned compression = value_of(attributes, "compression").byte();
  if (compression != 0 && compression != 3)
    unsupported(part.name, fmt::format("compression {} is not read, only none (0) and ZIP (3)", compression));
  part.is_zipped = compression == 3;
  if (value_of(attributes, "lineOrder").byte() != 0)
    unsupported(part.name, "only the line order INCREASING_Y is read");
  read_window(attributes, limits, part);
  if (type == "tiledimage") read_tiles(attributes, part);
  part.channels = channels_of(attributes, max_name_size, part.name, limits);
  const std::int32_t chunks = value_of(attributes, "chunkCount").i32();
  if (std::cmp_not_equal(chunks, exr_chunk_count(part)))
    malformed(part.name, fmt::format("chunkCount is {} instead of {}", chunks, exr_chunk_count(part)));
  for (const StandardAttribute& standard : standard_attributes) attributes.erase(standard.name);
  for (const auto& [name, attribute] : attributes)
    if (attribute.type == "string") part.attributes[name] = text_of(attribute);
  return part;
}

constexpr std::uint32_t magic = 20000630;
constexpr std::uint32_t version_2 = 2;
constexpr std::uint32_t long_names = 0x400;
constexpr std::uint32_t multi_part = 0x1000;
constexpr std::size_t max_short_name = 31;

}  // namespace

std::string encode_exr_headers(const std::vector<ExrPart>& parts) {
  constexpr std::int32_t one = 0x3F800000;  // as a float
  const auto window = [](const ExrPart& p) { return exr_int32_bytes({0, 0, p.width - 1, p.height - 1}); };
  const bool is_picture = parts.size() == 1;
  std::string bytes;
  std::size_t longest = 0;  // of all names
  for (const ExrPart& part : parts) {
    std::string channels;
    for (const std::size_t c : exr_channel_order(part)) {
      longest = std::max(longest, part.channels[c].name.size());
      channels += part.channels[c].name + '\0' + exr_int32_bytes({part.channels[c].is_half ? 1 : 2, 0, 1, 1});
    }
    const auto chunks = static_cast<std::int32_t>(exr_chunk_count(part));
    std::map<std::string, std::pair<const char*, std::string>> attributes{
        {"name", {"string", part.name}},
        {"type", {"string", part.has_mipmaps ? "tiledimage" : "scanlineimage"}},
        {"channels", {"chlist", channels + '\0'}},
        {"compression", {"compression", {part.is_zipped ? '\3' : '\0'}}},
        {"dataWindow", {"box2i", window(part)}},
        {"displayWindow", {"box2i", window(parts.front())}},
        {"lineOrder", {"lineOrder", {'\0'}}},
        {"chunkCount", {"int", exr_int32_bytes({chunks})}},
        {"pixelAspectRatio", {"float", exr_int32_bytes({one})}},
        {"screenWindowCenter", {"v2f", exr_int32_bytes({0, 0})}},
        {"screenWindowWidth", {"float", exr_int32_bytes({one})}}};
    if (part.has_mipmaps)
      attributes["tiles"] = {"tiledesc", exr_int32_bytes({part.tile_size.x, part.tile_size.y}) + '\1'};
    if (is_picture) attributes.erase("chunkCount");
    for (const auto& [name, text] : part.attributes) attributes[name] = {"string", text};
    for (const auto& [name, attribute] : attributes) {
      const auto& [type, value] = attribute;
      longest = std::max(longest, name.size());
      bytes += name + '\0' + type + '\0' + exr_int32_bytes({static_cast<std::int32_t>(value.size())}) + value;
    }
    bytes += '\0';
  }
  const std::uint32_t flags = (is_picture ? 0 : multi_part) | (longest > max_short_name ? long_names : 0);
  bytes = exr_int32_bytes({magic, static_cast<std::int32_t>(version_2 | flags)}) + bytes;
  return is_picture ? bytes : bytes + '\0';
}

ExrLayout read_exr_headers(const InputFile& source, const ExrLimits& limits) {
  if (source.size() < 8) malformed({}, "is not an OpenEXR file");
  HeaderReader reader(source, limits);
  ExrByteReader start(reader.read(8));
  if (start.u32() != magic) {
    const std::string_view kind = foreign_file_message(source);
    malformed({}, kind.empty() ? "is not an OpenEXR file" : std::string(kind));
  }
  const std::uint32_t version = start.u32();
  if ((version & ~long_names) != (multi_part | version_2))
    unsupported({}, "is not a multi-part file of OpenEXR version 2");
  const std::size_t max_name_size = (version & long_names) != 0 ? 255 : max_short_name;
  ExrLayout layout;
  do {
    if (std::ssize(layout.parts) == limits.parts)
      throw_exr_failure(Code::file_too_large, {}, fmt::format("more than {} parts", limits.parts));
    ExrPart part = read_part(reader, max_name_size, layout.parts.size(), limits);
    for (const ExrPart& other : layout.parts)
      if (other.name == part.name) malformed(part.name, "duplicate part name");
    layout.parts.push_back(std::move(part));
  } while (reader.peek() != 0);
  layout.headers_end = reader.position() + 1;
  return layout;
}

}  // namespace selvedge
