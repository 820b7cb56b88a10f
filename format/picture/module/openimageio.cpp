#include "format/picture/openimageio.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <OpenImageIO/strutil.h>
#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <memory>
#include <string_view>
#include <vector>

#include "format/base/memory.h"

namespace selvedge {
namespace {

/// Channels of a file for R, G, B, A; -1 without alpha.
using Channels = std::array<int, 4>;

Channels first_channels(const OIIO::ImageSpec& spec) {
  const bool colour = spec.nchannels >= 3;
  return {0, colour ? 1 : 0, colour ? 2 : 0, spec.alpha_channel};
}

/// Channels of the first layer of an OpenEXR file that has R, G and B, or the file's first ones. Names of a
/// layer's channels differ after their last full stop.
Channels channels_of_exr(const OIIO::ImageSpec& spec) {
  const auto find = [&](const std::string& name) {
    const auto found = std::ranges::find_if(
        spec.channelnames, [&](const std::string& other) { return OIIO::Strutil::iequals(other, name); });
    return found == spec.channelnames.end() ? -1 : static_cast<int>(found - spec.channelnames.begin());
  };
  std::vector<std::string> layers{""};
  for (const std::string& name : spec.channelnames) layers.push_back(name.substr(0, name.rfind('.') + 1));
  for (const std::string& layer : layers) {
    const Channels named{find(layer + "R"), find(layer + "G"), find(layer + "B"), find(layer + "A")};
    if (std::min({named[0], named[1], named[2]}) >= 0) return named;
  }
  return first_channels(spec);
}

/// Linear colours of stored values. Those of 8 bits are few, and a power takes long.
class Decoder {
 public:
  explicit Decoder(const OIIO::ImageSpec& spec) : few_(spec.format == OIIO::TypeDesc::UINT8) {}
  float linear(float stored) {
    if (!few_) return srgb_to_linear(stored);
    float& known = known_[static_cast<std::size_t>(std::lround(stored * 255.0F))];
    if (known < 0) known = srgb_to_linear(stored);
    return known;
  }

 private:
  bool few_;
  std::vector<float> known_ = std::vector<float>(256, -1.0F);
};

/// The number of `from` pixels along a side that fall on pixel `at` of `to`.
std::int64_t count_on(std::int64_t at, std::int64_t from, std::int64_t to) {
  return ((at + 1) * from + to - 1) / to - (at * from + to - 1) / to;
}

void divide_by_counts(Image& image, const OIIO::ImageSpec& spec) {
  for (std::int64_t y = 0; y < image.height; ++y) {
    const std::int64_t rows = count_on(y, spec.height, image.height);
    for (std::int64_t x = 0; x < image.width; ++x) {
      const auto count = static_cast<float>(rows * count_on(x, spec.width, image.width));
      for (int c = 0; c < 4; ++c) image.pixels[(y * image.width + x) * 4 + c] /= count;
    }
  }
}

/// Some readers fail without a word, others with one for each channel.
std::string reason_of(const OIIO::ImageInput& input) {
  const std::string text = input.geterror();
  if (text.starts_with("Subsampled")) return "has channels of fewer pixels (RY, BY): save it with R, G and B";
  return text.empty() ? "cannot be decoded" : text.substr(0, text.find('\n'));
}

/// Reads strips of rows, and sums the pixels of each of the picture that is returned.
Result<Image> read_pixels(OIIO::ImageInput& input, std::size_t file_bytes, const std::string& name,
                          Transfer transfer, const ImageLimits& limits, int halvings) {
  const OIIO::ImageSpec& spec = input.spec();
  if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1 || spec.depth > 1 || spec.deep) {
    return fail(Code::image_unreadable, name, "", "not a flat two-dimensional picture");
  }
  const std::int64_t pixels = std::int64_t{spec.width} * spec.height;
  const std::string size =
      fmt::format("{} x {} pixels of {} channels", spec.width, spec.height, spec.nchannels);
  if (spec.width > limits.side || spec.height > limits.side || pixels * spec.nchannels > limits.pixels * 4)
    return fail(Code::file_too_large, name, "", size);
  const std::int64_t width = level_size(spec.width, halvings);
  const std::int64_t height = level_size(spec.height, halvings);
  // Tiles come in rows of their own height, and may be larger than the picture.
  constexpr int rows_at_once = 64;
  const bool tiled = spec.tile_width > 0;
  const int strip = tiled ? spec.height : std::min(spec.height, rows_at_once);
  const std::int64_t most =
      tiled ? std::max(pixels, std::int64_t{spec.tile_width} * spec.tile_height) : pixels;
  const std::uint64_t channels = spec.nchannels;
  // A reader may hold its file once more, and all pixels as they are stored: interlaced ones, progressive
  // ones, the pixels of one strip or tile.
  MemoryAccount account(limits.memory);
  if (!account.take(file_bytes, 2) || !account.take(most, spec.pixel_bytes(true)) ||
      !account.take(tiled ? most : std::int64_t{strip} * spec.width, channels * sizeof(float)) ||
      !account.take(width * height, 4 * sizeof(float)))
    return tl::unexpected<Error>(beyond_memory(name, "", size, limits.memory));
  // Rows take memory as they come: a header may declare what the file does not have.
  Image image{static_cast<int>(width), static_cast<int>(height), 4, {}};
  image.pixels.reserve(width * height * 4);
  const bool decode = transfer == Transfer::srgb && !spec.format.is_floating_point();
  const bool is_exr = input.format_name() == std::string_view("openexr");
  const Channels order = is_exr ? channels_of_exr(spec) : first_channels(spec);
  // WebP's reader multiplies colours by alpha, whatever it is asked for.
  const bool multiplied = input.format_name() == std::string_view("webp");
  Decoder decoder(spec);
  std::vector<std::int64_t> columns(spec.width);  // where the pixels of a row go
  for (std::int64_t x = 0; x < spec.width; ++x) columns[x] = x * width / spec.width * 4;
  std::vector<float> stored(strip * spec.width * channels);
  for (int first = 0; first < spec.height; first += strip) {
    const int end = std::min(first + strip, spec.height);
    const OIIO::TypeDesc floats = OIIO::TypeDesc::FLOAT;
    const bool read = tiled ? input.read_image(0, 0, 0, spec.nchannels, floats, stored.data())
                            : input.read_scanlines(0, 0, spec.y + first, spec.y + end, 0, 0, spec.nchannels,
                                                   floats, stored.data());
    if (!read) return fail(Code::image_unreadable, name, "", reason_of(input));
    image.pixels.resize(((end - std::int64_t{1}) * height / spec.height + 1) * width * 4);
    for (std::int64_t y = first; y < end; ++y) {
      float* row = &image.pixels[y * height / spec.height * width * 4];
      const float* from = &stored[(y - first) * spec.width * channels];
      for (const std::int64_t column : columns) {
        float* pixel = row + column;
        const float alpha = order[3] < 0 ? 1.0F : from[order[3]];
        for (int c = 0; c < 4; ++c) {
          float value = order[c] < 0 ? 1.0F : from[order[c]];
          if (multiplied && c < 3 && alpha > 0) value = std::min(value / alpha, 1.0F);
          pixel[c] += decode && c < 3 ? decoder.linear(value) : value;
        }
        from += channels;
      }
    }
  }
  if (halvings > 0) divide_by_counts(image, spec);
  return image;
}

/// The chunks of a PNG that its pixels need. Each of a thousand texts and profiles would be decompressed, to
/// up to 8 MB, which no header declares.
std::vector<std::uint8_t> without_texts(std::span<const std::uint8_t> png) {
  constexpr std::size_t signature = 8;
  constexpr std::size_t around = 12;  // a chunk's length, name and checksum
  std::vector<std::uint8_t> kept(png.begin(), png.begin() + std::min(png.size(), signature));
  for (png = png.subspan(kept.size()); png.size() >= around;) {
    const std::size_t length = std::size_t{png[0]} << 24U | png[1] << 16U | png[2] << 8U | png[3];
    const std::string_view type(reinterpret_cast<const char*>(&png[4]), 4);
    const auto chunk = png.first(std::min(png.size(), length + around));
    if (type == "IHDR" || type == "PLTE" || type == "tRNS" || type == "IDAT" || type == "IEND")
      kept.insert(kept.end(), chunk.begin(), chunk.end());
    png = png.subspan(chunk.size());
  }
  return kept;
}

/// Whether much more than the pixels is packed in a PNG: libpng unpacks all of it, a thousand times its
/// bytes. Precondition: without_texts() made it.
bool holds_more_than_pixels(std::span<const std::uint8_t> png) {
  constexpr std::size_t header = 33;  // signature and IHDR
  constexpr std::size_t tolerated = std::size_t{1} << 22;
  constexpr std::size_t quickly_unpacked = 100000;
  if (png.size() < std::max(header, quickly_unpacked)) return false;
  const auto word = [&](std::size_t at) {
    return std::size_t{png[at]} << 24U | png[at + 1] << 16U | png[at + 2] << 8U | png[at + 3];
  };
  constexpr std::array<std::size_t, 7> samples{1, 0, 3, 1, 2, 0, 4};
  const std::size_t bits = png[24] * samples[std::min<std::size_t>(png[25], 6)];
  std::size_t left = word(20) * (word(16) * bits / 8 + 2) + tolerated;
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) return false;
  const std::unique_ptr<z_stream, decltype(&inflateEnd)> ended(&stream, &inflateEnd);
  std::vector<std::uint8_t> unpacked(std::size_t{1} << 16);
  for (std::size_t at = header; at + 12 <= png.size(); at += word(at) + 12) {
    if (png[at + 4] != 'I' || png[at + 5] != 'D') continue;
    stream.next_in = const_cast<std::uint8_t*>(&png[at + 8]);
    stream.avail_in = static_cast<unsigned>(std::min(word(at), png.size() - at - 8));
    while (stream.avail_in > 0) {
      stream.next_out = unpacked.data();
      stream.avail_out = static_cast<unsigned>(unpacked.size());
      if (inflate(&stream, Z_NO_FLUSH) != Z_OK) return false;
      const std::size_t made = unpacked.size() - stream.avail_out;
      if (made > left) return true;
      left -= made;
    }
  }
  return false;
}

Result<Image> read(const char* format, std::span<const std::uint8_t> bytes, const std::string& name,
                   Transfer transfer, const ImageLimits& limits, int halvings) {
  const auto refuse = [&](std::string why) { return fail(Code::image_unreadable, name, "", std::move(why)); };
  try {
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);  // else PNG's alpha would be multiplied into the colours
    std::vector<std::uint8_t> kept;
    if (format == std::string_view("png")) {
      bytes = kept = without_texts(bytes);
      if (holds_more_than_pixels(bytes)) return refuse("holds more than its pixels");
    }
    OIIO::Filesystem::IOMemReader source(bytes.data(), bytes.size());
    const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::create(format);
    if (!input) return refuse(OIIO::geterror());
    // In the configuration instead of set_ioproxy(), which readers forget when they reopen the file.
    OIIO::Filesystem::IOProxy* proxy = &source;
    config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    OIIO::ImageSpec spec;
    if (!input->open(name, spec, config)) return refuse(reason_of(*input));
    return read_pixels(*input, bytes.size(), name, transfer, limits, halvings);
  } catch (const std::exception& error) {
    return refuse(error.what());
  }
}

}  // namespace

extern "C" __attribute__((visibility("default"))) const OpenImageIo selvedge_openimageio;
const OpenImageIo selvedge_openimageio{read};

}  // namespace selvedge
