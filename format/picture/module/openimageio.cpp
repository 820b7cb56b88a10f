#include "format/picture/openimageio.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <exception>
#include <memory>
#include <string_view>
#include <vector>

namespace selvedge {
namespace {

/// Channels of the file for R, G, B, A; -1 without alpha.
std::array<int, 4> channel_order(const OIIO::ImageSpec& spec) {
  std::array<int, 4> order{};
  const std::array<const char*, 4> names{"R", "G", "B", "A"};
  for (std::size_t i = 0; i < 4; ++i) order[i] = spec.channelindex(names[i]);
  if (order[0] < 0 || order[1] < 0 || order[2] < 0) {
    const bool colour = spec.nchannels >= 3;
    order = {0, colour ? 1 : 0, colour ? 2 : 0, spec.alpha_channel};
  }
  return order;
}

Result<Image> read_pixels(OIIO::ImageInput& input, const std::string& name, Transfer transfer,
                          const ImageLimits& limits) {
  const OIIO::ImageSpec& spec = input.spec();
  if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1 || spec.depth > 1 || spec.deep) {
    return fail(Code::image_unreadable, name, "", "not a flat two-dimensional picture");
  }
  const std::int64_t pixels = std::int64_t{spec.width} * spec.height;
  if (spec.width > limits.side || spec.height > limits.side || pixels * spec.nchannels > limits.pixels * 4) {
    return fail(Code::file_too_large, name, "",
                fmt::format("{} x {} pixels of {} channels", spec.width, spec.height, spec.nchannels));
  }
  std::vector<float> stored(pixels * spec.nchannels);
  if (!input.read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, stored.data())) {
    return fail(Code::image_unreadable, name, "", input.geterror());
  }
  const bool decode = transfer == Transfer::srgb && !spec.format.is_floating_point();
  const std::array<int, 4> order = channel_order(spec);
  Image image{spec.width, spec.height, 4, std::vector<float>(pixels * 4, 1.0F)};
  for (std::int64_t p = 0; p < pixels; ++p) {
    for (int c = 0; c < 4; ++c) {
      if (order[c] < 0) continue;
      const float value = stored[p * spec.nchannels + order[c]];
      image.pixels[p * 4 + c] = decode && c < 3 ? srgb_to_linear(value) : value;
    }
  }
  return image;
}

/// The format of a file in memory, which OpenImageIO does not detect itself; null for other formats, such as
/// OpenEXR, whose library allocates what damaged headers declare.
const char* format_of(std::span<const std::uint8_t> bytes) {
  const auto starts_with = [&](std::initializer_list<std::uint8_t> magic) {
    return bytes.size() >= magic.size() && std::equal(magic.begin(), magic.end(), bytes.begin());
  };
  if (starts_with({0x89, 'P', 'N', 'G'})) return "png";
  return starts_with({0xFF, 0xD8, 0xFF}) ? "jpeg" : nullptr;
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

Result<Image> read(const std::string& name, std::span<const std::uint8_t> bytes, Transfer transfer,
                   const ImageLimits& limits) {
  const auto refuse = [&](std::string why) { return fail(Code::image_unreadable, name, "", std::move(why)); };
  try {
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);  // else PNG's alpha would be multiplied into the colours
    if (bytes.empty()) {
      const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(name, &config);
      return input ? read_pixels(*input, name, transfer, limits) : refuse(OIIO::geterror());
    }
    const char* format = format_of(bytes);
    if (format == nullptr) return refuse("neither PNG nor JPEG");
    std::vector<std::uint8_t> kept;
    if (format == std::string_view("png")) bytes = kept = without_texts(bytes);
    OIIO::Filesystem::IOMemReader source(bytes.data(), bytes.size());
    const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::create(format);
    if (!input) return refuse(OIIO::geterror());
    // In the configuration instead of set_ioproxy(), which readers forget when they reopen the file.
    OIIO::Filesystem::IOProxy* proxy = &source;
    config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    OIIO::ImageSpec spec;
    if (!input->open(name, spec, config)) return refuse(input->geterror());
    return read_pixels(*input, name, transfer, limits);
  } catch (const std::exception& error) {
    return refuse(error.what());
  }
}

Result<std::vector<std::uint8_t>> encode(const char* extension, const OIIO::ImageSpec& spec,
                                         const OIIO::TypeDesc& type, const void* pixels) {
  const auto refuse = [&](std::string why) {
    return fail(Code::image_unwritable, "", extension, std::move(why));
  };
  try {
    const std::string name = std::string("memory.") + extension;
    const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(name);
    if (!output) return refuse(OIIO::geterror());
    OIIO::Filesystem::IOVecOutput sink;
    if (!output->set_ioproxy(&sink) || !output->open(name, spec) || !output->write_image(type, pixels) ||
        !output->close()) {
      return refuse(output->geterror());
    }
    return sink.buffer();
  } catch (const std::exception& error) {
    return refuse(error.what());
  }
}

Result<std::vector<std::uint8_t>> encode_png(const Image& image, std::span<const std::uint8_t> bytes,
                                             Transfer transfer) {
  OIIO::ImageSpec spec(image.width, image.height, image.channels, OIIO::TypeDesc::UINT8);
  if (has_alpha(image)) spec.alpha_channel = image.channels - 1;
  spec.attribute("oiio:UnassociatedAlpha", 1);
  if (transfer == Transfer::srgb) spec.attribute("oiio:ColorSpace", "sRGB");
  return encode("png", spec, OIIO::TypeDesc::UINT8, bytes.data());
}

Result<std::vector<std::uint8_t>> encode_exr(const Image& image) {
  OIIO::ImageSpec spec(image.width, image.height, image.channels, OIIO::TypeDesc::FLOAT);
  if (image.channels == 1) spec.channelnames = {"Y"};
  if (image.channels == 2) spec.channelnames = {"Y", "A"};
  if (has_alpha(image)) spec.alpha_channel = image.channels - 1;
  spec.attribute("compression", "zip");
  // Otherwise OpenImageIO adds the current time.
  spec.attribute("DateTime", "2001:06:25 00:00:00");
  return encode("exr", spec, OIIO::TypeDesc::FLOAT, image.pixels.data());
}

}  // namespace

extern "C" __attribute__((visibility("default"))) const OpenImageIo selvedge_openimageio;
const OpenImageIo selvedge_openimageio{read, encode_png, encode_exr};

}  // namespace selvedge
