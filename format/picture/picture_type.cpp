#include "format/picture/picture_type.h"

namespace selvedge {
namespace {

using Size = Imath::Vec2<std::int64_t>;

Size picture_size(std::int64_t width, std::int64_t height) {
  return width > 0 && height > 0 ? Size(width, height) : Size(0, 0);
}

/// The size of the first frame: segments are skipped by their lengths.
Size jpeg_size(std::span<const std::uint8_t> bytes) {
  const auto word = [&](std::size_t at) { return bytes[at] * 256 + bytes[at + 1]; };
  std::size_t at = 2;
  while (at + 9 <= bytes.size()) {
    const int marker = bytes[at + 1];
    if (bytes[at] != 0xFF || marker == 0xFF) {
      ++at;  // fill
      continue;
    }
    // Frames are C0 to CF but for tables of codes, an extension and arithmetic coding.
    if (marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC)
      return picture_size(word(at + 7), word(at + 5));
    const bool bare = marker == 0 || marker == 1 || (marker >= 0xD0 && marker <= 0xD8);
    at += 2 + (bare ? 0 : static_cast<std::size_t>(word(at + 2)));
  }
  return {0, 0};
}

/// By the first chunk: of a lossy or a lossless picture, or of a canvas.
Size webp_size(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 30) return {0, 0};
  const auto number = [&](std::size_t at, std::size_t size) {
    std::int64_t value = 0;
    while (size-- > 0) value = value * 256 + bytes[at + size];
    return value;
  };
  constexpr std::int64_t side = 0x3fff;
  if (bytes[15] == ' ') return picture_size(number(26, 2) & side, number(28, 2) & side);
  if (bytes[15] == 'X') return picture_size(number(24, 3) + 1, number(27, 3) + 1);
  return picture_size((number(21, 4) & side) + 1, ((number(21, 4) >> 14) & side) + 1);
}

}  // namespace

std::string_view picture_type(std::span<const std::uint8_t> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const auto at = [&](std::size_t begin, std::string_view magic) {
    return text.size() >= begin + magic.size() && text.substr(begin).starts_with(magic);
  };
  if (at(0, "\x89PNG")) return "image/png";
  if (at(0, "\xFF\xD8\xFF")) return "image/jpeg";
  if (at(0, "RIFF") && at(8, "WEBP")) return "image/webp";
  if (at(0, "\xABKTX 20\xBB\r\n\x1A\n")) return "image/ktx2";
  if (at(4, "ftypavif") || at(4, "ftypavis")) return "image/avif";
  return at(0, "DDS ") ? "image/vnd-ms.dds" : "";
}

Imath::Vec2<std::int64_t> picture_size(std::span<const std::uint8_t> bytes) {
  const std::string_view type = picture_type(bytes);
  const auto number = [&](std::size_t at) {
    std::int64_t value = 0;
    for (std::size_t i = at; i < at + 4; ++i) value = value * 256 + bytes[i];
    return value;
  };
  if (type == "image/png") return bytes.size() >= 24 ? picture_size(number(16), number(20)) : Size(0, 0);
  if (type == "image/webp") return webp_size(bytes);
  return type == "image/jpeg" ? jpeg_size(bytes) : Size(0, 0);
}

std::uint64_t picture_pixel_count(std::span<const std::uint8_t> bytes) {
  const Size size = picture_size(bytes);
  return static_cast<std::uint64_t>(size.x) * static_cast<std::uint64_t>(size.y);
}

}  // namespace selvedge
