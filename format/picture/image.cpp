#include "format/picture/image.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <limits>
#include <memory>

#include "format/base/atomic_file.h"
#include "format/base/input_file.h"

namespace selvedge {
namespace {

std::size_t pixel_count(const Image& image) {
  return static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
}

Result<void> check(const Image& image, const std::string& name) {
  if (image.width < 1 || image.height < 1 || image.channels < 1 || image.channels > 4) {
    return fail(
        Code::image_unwritable, name, "",
        fmt::format("cannot write {} x {} pixels of {} channels", image.width, image.height, image.channels));
  }
  if (image.pixels.size() != pixel_count(image) * static_cast<std::size_t>(image.channels)) {
    return fail(Code::image_unwritable, name, "",
                fmt::format("{} values for {} x {} pixels of {} channels", image.pixels.size(), image.width,
                            image.height, image.channels));
  }
  return {};
}

/// Channels of the file that serve as R, G, B, A; -1 for an alpha that is not there.
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

Result<Image> read(OIIO::ImageInput& input, const std::string& name, Transfer transfer,
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
  const auto count = static_cast<std::size_t>(spec.nchannels);
  std::vector<float> stored(static_cast<std::size_t>(pixels) * count);
  if (!input.read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, stored.data())) {
    return fail(Code::image_unreadable, name, "", input.geterror());
  }
  const bool decode = transfer == Transfer::srgb && !spec.format.is_floating_point();
  const std::array<int, 4> order = channel_order(spec);
  Image image{spec.width, spec.height, 4, std::vector<float>(static_cast<std::size_t>(pixels) * 4, 1.0F)};
  for (std::size_t p = 0; p < static_cast<std::size_t>(pixels); ++p) {
    for (std::size_t c = 0; c < 4; ++c) {
      if (order[c] < 0) continue;
      const float value = stored[p * count + static_cast<std::size_t>(order[c])];
      image.pixels[p * 4 + c] = decode && c < 3 ? srgb_to_linear(value) : value;
    }
  }
  return image;
}

/// PNG's alpha would otherwise be multiplied into the colours.
OIIO::ImageSpec unassociated() {
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);
  return config;
}

Result<std::vector<std::uint8_t>> encode(const char* extension, const OIIO::ImageSpec& spec,
                                         const OIIO::TypeDesc& type, const void* pixels) {
  try {
    const std::string name = std::string("memory.") + extension;
    const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(name);
    if (!output) return fail(Code::image_unwritable, "", extension, OIIO::geterror());
    OIIO::Filesystem::IOVecOutput sink;
    if (!output->set_ioproxy(&sink) || !output->open(name, spec) || !output->write_image(type, pixels) ||
        !output->close()) {
      return fail(Code::image_unwritable, "", extension, output->geterror());
    }
    return std::vector<std::uint8_t>(sink.buffer());
  } catch (const std::exception& error) {
    return fail(Code::image_unwritable, "", extension, error.what());
  }
}

Result<void> write(const std::string& path, Result<std::vector<std::uint8_t>> bytes) {
  if (!bytes) {
    Error error = std::move(bytes.error());
    error.file = path;
    return tl::unexpected<Error>(std::move(error));
  }
  return write_file(path, *bytes);
}

}  // namespace

float srgb_to_linear(float encoded) {
  return encoded <= 0.04045F ? encoded / 12.92F : std::pow((encoded + 0.055F) / 1.055F, 2.4F);
}

float linear_to_srgb(float linear) {
  return linear <= 0.0031308F ? linear * 12.92F : 1.055F * std::pow(linear, 1.0F / 2.4F) - 0.055F;
}

Result<Image> read_image(const std::string& path, Transfer transfer, const ImageLimits& limits) {
  // OpenImageIO would wait for a pipe.
  if (const Result<InputFile> file = InputFile::open(path); !file) return tl::unexpected(file.error());
  try {
    const OIIO::ImageSpec config = unassociated();
    const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(path, &config);
    if (!input) return fail(Code::image_unreadable, path, "", OIIO::geterror());
    return read(*input, path, transfer, limits);
  } catch (const std::exception& error) {
    return fail(Code::image_unreadable, path, "", error.what());
  }
}

Result<Image> decode_image(std::span<const std::uint8_t> bytes, const std::string& name, Transfer transfer,
                           const ImageLimits& limits) {
  // OpenImageIO looks at the content only of what is on disk.
  const auto starts_with = [&](std::initializer_list<std::uint8_t> magic) {
    return bytes.size() >= magic.size() && std::equal(magic.begin(), magic.end(), bytes.begin());
  };
  const char* format = starts_with({0x89, 'P', 'N', 'G'})      ? "png"
                       : starts_with({0xFF, 0xD8, 0xFF})       ? "jpeg"
                       : starts_with({0x76, 0x2F, 0x31, 0x01}) ? "openexr"
                                                               : nullptr;
  if (format == nullptr) return fail(Code::image_unreadable, name, "", "neither PNG, JPEG nor EXR");
  try {
    OIIO::Filesystem::IOMemReader source(bytes.data(), bytes.size());
    const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::create(format);
    if (!input) return fail(Code::image_unreadable, name, "", OIIO::geterror());
    // In the configuration and not by set_ioproxy, which the readers forget when they have to start again.
    OIIO::ImageSpec config = unassociated();
    OIIO::Filesystem::IOProxy* proxy = &source;
    config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    OIIO::ImageSpec spec;
    if (!input->open(name, spec, config)) {
      return fail(Code::image_unreadable, name, "", input->geterror());
    }
    return read(*input, name, transfer, limits);
  } catch (const std::exception& error) {
    return fail(Code::image_unreadable, name, "", error.what());
  }
}

Result<std::vector<std::uint8_t>> encode_png(const Image& image, Transfer transfer) {
  if (Result<void> good = check(image, ""); !good) return tl::unexpected<Error>(std::move(good.error()));
  const bool has_alpha = image.channels == 2 || image.channels == 4;
  const auto channels = static_cast<std::size_t>(image.channels);
  std::vector<std::uint8_t> stored(image.pixels.size());
  for (std::size_t i = 0; i < stored.size(); ++i) {
    const bool alpha = has_alpha && i % channels == channels - 1;
    float value = image.pixels[i];
    value = value > 0.0F ? std::min(value, 1.0F) : 0.0F;
    if (transfer == Transfer::srgb && !alpha) value = linear_to_srgb(value);
    stored[i] = static_cast<std::uint8_t>(std::lround(value * 255.0F));
  }
  OIIO::ImageSpec spec(image.width, image.height, image.channels, OIIO::TypeDesc::UINT8);
  if (has_alpha) spec.alpha_channel = image.channels - 1;
  spec.attribute("oiio:UnassociatedAlpha", 1);
  if (transfer == Transfer::srgb) spec.attribute("oiio:ColorSpace", "sRGB");
  return encode("png", spec, OIIO::TypeDesc::UINT8, stored.data());
}

Result<void> write_png(const std::string& path, const Image& image, Transfer transfer) {
  return write(path, encode_png(image, transfer));
}

Result<void> write_exr(const std::string& path, const Image& image) {
  if (Result<void> good = check(image, path); !good) return good;
  OIIO::ImageSpec spec(image.width, image.height, image.channels, OIIO::TypeDesc::FLOAT);
  if (image.channels == 1) spec.channelnames = {"Y"};
  if (image.channels == 2) spec.channelnames = {"Y", "A"};
  if (image.channels == 4 || image.channels == 2) spec.alpha_channel = image.channels - 1;
  spec.attribute("compression", "zip");
  // OpenImageIO adds the time of day where there is none.
  spec.attribute("DateTime", "2001:06:25 00:00:00");
  return write(path, encode("exr", spec, OIIO::TypeDesc::FLOAT, image.pixels.data()));
}

Result<ImageDifference> compare_images(const Image& a, const Image& b) {
  if (a.width != b.width || a.height != b.height || a.channels != b.channels ||
      a.pixels.size() != b.pixels.size()) {
    return fail(Code::image_mismatch, "", "",
                fmt::format("{} x {} x {} against {} x {} x {}", a.width, a.height, a.channels, b.width,
                            b.height, b.channels));
  }
  ImageDifference difference;
  double sum = 0;
  double of_colours = 0;
  const auto channels = static_cast<std::size_t>(a.channels);
  const std::size_t colours = channels % 2 == 0 ? channels - 1 : channels;  // the second or fourth is opacity
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    const double x = a.pixels[i];
    const double y = b.pixels[i];
    double d = 0;
    if (!(x == y) && !(std::isnan(x) && std::isnan(y))) d = std::abs(x - y);
    if (std::isnan(d)) d = std::numeric_limits<double>::infinity();
    sum += d * d;
    if (i % channels < colours) of_colours += d * d;
    if (d > difference.max_absolute) {
      const std::size_t pixel = i / channels;
      difference.max_absolute = d;
      difference.channel = static_cast<int>(i % channels);
      difference.x = static_cast<int>(pixel % static_cast<std::size_t>(a.width));
      difference.y = static_cast<int>(pixel / static_cast<std::size_t>(a.width));
    }
  }
  if (!a.pixels.empty()) difference.rmse = std::sqrt(sum / static_cast<double>(a.pixels.size()));
  difference.psnr = std::numeric_limits<double>::infinity();
  if (of_colours > 0) {
    const std::size_t count = a.pixels.size() / channels * colours;
    difference.psnr = -10.0 * std::log10(of_colours / static_cast<double>(count));
  }
  return difference;
}

}  // namespace selvedge
