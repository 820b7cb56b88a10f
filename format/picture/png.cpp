// PNG files, written without OpenImageIO, which takes longer to load than a small picture to draw.
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "format/base/atomic_file.h"
#include "format/base/srgb.h"
#include "format/picture/image.h"

namespace {

/// As stb wants it: memory of malloc(), or null.
unsigned char* deflate_png(unsigned char* data, int size, int* count, int /*level*/) {
  constexpr int level = 6;
  uLongf bytes = compressBound(size);
  auto* const packed = static_cast<unsigned char*>(std::malloc(bytes));
  if (packed != nullptr && compress2(packed, &bytes, data, size, level) != Z_OK) bytes = 0;
  *count = static_cast<int>(bytes);
  return packed;
}

}  // namespace

#define STBIW_ZLIB_COMPRESS deflate_png
#define STBI_WRITE_NO_STDIO
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb/stb_image_write.h>

namespace selvedge {

Result<std::vector<std::uint8_t>> encode_png(const Image& image, Transfer transfer) {
  if (Result<void> good = check_image_shape(image, ""); !good) return tl::unexpected(good.error());
  // stb counts bytes as int.
  constexpr std::size_t max_values = std::size_t{1} << 30;
  if (image.pixels.size() > max_values) return fail(Code::image_unwritable, "", "", "more than 2^30 values");
  std::vector<std::uint8_t> stored(image.pixels.size());
  for (std::size_t i = 0; i < stored.size(); ++i) {
    const bool alpha = has_alpha(image) && i % image.channels == image.channels - std::size_t{1};
    float value = image.pixels[i];
    value = value > 0.0F ? std::min(value, 1.0F) : 0.0F;
    if (transfer == Transfer::srgb && !alpha) value = linear_to_srgb(value);
    stored[i] = static_cast<std::uint8_t>(std::lround(value * 255.0F));
  }
  std::vector<std::uint8_t> png;
  const auto add = [](void* to, void* data, int size) {
    auto& all = *static_cast<std::vector<std::uint8_t>*>(to);
    const auto* const first = static_cast<const std::uint8_t*>(data);
    all.insert(all.end(), first, first + size);
  };
  if (stbi_write_png_to_func(add, &png, image.width, image.height, image.channels, stored.data(), 0) == 0)
    return fail(Code::image_unwritable, "", "", "no memory");
  // A chunk sRGB of perceptual intent, behind the header, whose length is fixed.
  constexpr std::array<std::uint8_t, 13> chunk{0, 0, 0, 1, 's', 'R', 'G', 'B', 0, 0xAE, 0xCE, 0x1C, 0xE9};
  if (transfer == Transfer::srgb) png.insert(png.begin() + 33, chunk.begin(), chunk.end());
  return png;
}

void add_png_text(const std::string& key, const std::string& text, std::vector<std::uint8_t>& png) {
  const std::string body = "tEXt" + key + '\0' + text;
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(body.data());
  std::vector<std::uint8_t> chunk;
  const auto add_number = [&](std::uint32_t number) {
    for (const int shift : {24, 16, 8, 0}) chunk.push_back(static_cast<std::uint8_t>(number >> shift));
  };
  add_number(static_cast<std::uint32_t>(body.size() - 4));
  chunk.insert(chunk.end(), bytes, bytes + body.size());
  add_number(static_cast<std::uint32_t>(crc32(0, bytes, static_cast<uInt>(body.size()))));
  // Behind the header, whose length is fixed.
  png.insert(png.begin() + 33, chunk.begin(), chunk.end());
}

std::string png_text(const std::string& path, const std::string& key) {
  const std::string png = read_file(path).value_or("");
  const std::string begin = "tEXt" + key + '\0';
  for (std::size_t at = 8; at + 12 <= png.size();) {
    std::size_t size = 0;
    for (std::size_t i = 0; i < 4; ++i) size = size << 8 | static_cast<std::uint8_t>(png[at + i]);
    if (size > png.size() - at - 12) break;
    if (png.compare(at + 4, begin.size(), begin) == 0 && size + 4 >= begin.size())
      return png.substr(at + 4 + begin.size(), size + 4 - begin.size());
    at += size + 12;
  }
  return {};
}

Result<void> write_png(const std::string& path, const Image& image, Transfer transfer) {
  Result<std::vector<std::uint8_t>> bytes = encode_png(image, transfer);
  if (bytes) return write_file(path, *bytes);
  bytes.error().file = path;
  return tl::unexpected(bytes.error());
}

}  // namespace selvedge
