#include "format/picture/image.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "format/base/atomic_file.h"
#include "format/base/input_file.h"
#include "format/picture/openimageio.h"

namespace selvedge {
namespace {

Result<void> check(const Image& image, const std::string& name) {
  if (image.width < 1 || image.height < 1 || image.channels < 1 || image.channels > 4) {
    return fail(
        Code::image_unwritable, name, "",
        fmt::format("cannot write {} x {} pixels of {} channels", image.width, image.height, image.channels));
  }
  if (image.pixels.size() != std::size_t{1} * image.width * image.height * image.channels) {
    return fail(Code::image_unwritable, name, "",
                fmt::format("{} values for {} x {} pixels of {} channels", image.pixels.size(), image.width,
                            image.height, image.channels));
  }
  return {};
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

Result<const OpenImageIo*> load_openimageio(Code code) {
  static const auto table = []() -> tl::expected<const OpenImageIo*, std::string> {
    void* module = dlopen("libselvedge-openimageio.so", RTLD_NOW | RTLD_LOCAL);
    if (module == nullptr) return tl::unexpected<std::string>(dlerror());
    return static_cast<const OpenImageIo*>(dlsym(module, "selvedge_openimageio"));
  }();
  if (!table) return fail(code, "", "", table.error());
  return *table;
}

Result<Image> read_image(const std::string& path, Transfer transfer, const ImageLimits& limits) {
  // Refuses pipes, for which OpenImageIO would wait.
  if (const Result<InputFile> file = InputFile::open(path); !file) return tl::unexpected(file.error());
  const auto library = load_openimageio(Code::image_unreadable);
  if (!library) return tl::unexpected(library.error());
  return (*library)->read(path, {}, transfer, limits, 0);
}

Result<Image> decode_image(std::span<const std::uint8_t> bytes, const std::string& name, Transfer transfer,
                           const ImageLimits& limits, int halvings) {
  if (bytes.empty()) return fail(Code::image_unreadable, name, "", "neither PNG nor JPEG");
  const auto library = load_openimageio(Code::image_unreadable);
  if (!library) return tl::unexpected(library.error());
  return (*library)->read(name, bytes, transfer, limits, halvings);
}

Result<std::vector<std::uint8_t>> encode_png(const Image& image, Transfer transfer) {
  if (Result<void> good = check(image, ""); !good) return tl::unexpected(good.error());
  const auto library = load_openimageio(Code::image_unwritable);
  if (!library) return tl::unexpected(library.error());
  std::vector<std::uint8_t> stored(image.pixels.size());
  for (std::size_t i = 0; i < stored.size(); ++i) {
    const bool alpha = has_alpha(image) && i % image.channels == image.channels - std::size_t{1};
    float value = image.pixels[i];
    value = value > 0.0F ? std::min(value, 1.0F) : 0.0F;
    if (transfer == Transfer::srgb && !alpha) value = linear_to_srgb(value);
    stored[i] = static_cast<std::uint8_t>(std::lround(value * 255.0F));
  }
  return (*library)->encode_png(image, stored, transfer);
}

Result<void> write_png(const std::string& path, const Image& image, Transfer transfer) {
  return write(path, encode_png(image, transfer));
}

Result<void> write_exr(const std::string& path, const Image& image) {
  if (Result<void> good = check(image, path); !good) return good;
  const auto library = load_openimageio(Code::image_unwritable);
  if (!library) return tl::unexpected(library.error());
  return write(path, (*library)->encode_exr(image));
}

Result<void> check_same_size(const Image& a, const Image& b) {
  if (a.width == b.width && a.height == b.height && a.channels == b.channels &&
      a.pixels.size() == b.pixels.size())
    return {};
  return fail(Code::image_mismatch, "", "",
              fmt::format("{} x {} x {} against {} x {} x {}", a.width, a.height, a.channels, b.width,
                          b.height, b.channels));
}

Result<ImageDifference> compare_images(const Image& a, const Image& b) {
  if (const auto same = check_same_size(a, b); !same) return tl::unexpected(same.error());
  ImageDifference difference;
  double sum = 0;
  double colour_sum = 0;
  const std::size_t channels = a.channels;
  const std::size_t colours = has_alpha(a) ? channels - 1 : channels;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    const double x = a.pixels[i];
    const double y = b.pixels[i];
    double d = 0;
    if (!(x == y) && !(std::isnan(x) && std::isnan(y))) d = std::abs(x - y);
    if (std::isnan(d)) d = std::numeric_limits<double>::infinity();
    sum += d * d;
    if (i % channels < colours) colour_sum += d * d;
    if (d > difference.max_absolute) {
      const std::size_t pixel = i / channels;
      difference.max_absolute = d;
      difference.channel = static_cast<int>(i % channels);
      difference.x = static_cast<int>(pixel % a.width);
      difference.y = static_cast<int>(pixel / a.width);
    }
  }
  if (!a.pixels.empty()) difference.rmse = std::sqrt(sum / static_cast<double>(a.pixels.size()));
  difference.psnr = std::numeric_limits<double>::infinity();
  if (colour_sum > 0) {
    const std::size_t count = a.pixels.size() / channels * colours;
    difference.psnr = -10.0 * std::log10(colour_sum / static_cast<double>(count));
  }
  return difference;
}

}  // namespace selvedge
