#include "format/picture/image.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <array>
#include <cstring>
#include <string_view>

#include "format/base/atomic_file.h"
#include "format/base/foreign.h"
#include "format/exr/exr.h"
#include "format/picture/openimageio.h"
#include "format/picture/picture_type.h"

namespace selvedge {
namespace {

/// The reader of OpenImageIO, or "hdr", for a file that begins so; null for all others. OpenImageIO is never
/// asked to find one itself: FITS's, for one, does not end on some headers.
const char* format_of(std::string_view bytes) {
  if (bytes.starts_with("\x89PNG")) return "png";
  if (bytes.starts_with("\xFF\xD8\xFF")) return "jpeg";
  if (bytes.starts_with("RIFF") && bytes.size() > 11 && bytes.substr(8, 4) == "WEBP") return "webp";
  if (bytes.starts_with("II") || bytes.starts_with("MM")) return "tiff";
  if (bytes.starts_with("\x76\x2F\x31\x01")) return "openexr";
  if (bytes.starts_with("#?")) return "hdr";
  return bytes.size() > 1 && bytes[0] == 'P' && std::strchr("123456Ff", bytes[1]) != nullptr ? "pnm"
                                                                                             : nullptr;
}

/// Whether an attribute of an OpenEXR header is longer than the file: OpenEXR takes its memory first.
bool declares_more_than_it_has(std::span<const std::uint8_t> exr) {
  constexpr std::uint8_t many_parts = 0x10;
  for (std::size_t at = 8; at + 1 < exr.size();) {
    if (exr[at] == 0) {
      if ((exr[5] & many_parts) == 0 || exr[++at] == 0) return false;
      continue;
    }
    for (int text = 0; text < 2 && at < exr.size(); ++text)  // name and type
      at = static_cast<std::size_t>(std::find(exr.begin() + static_cast<std::ptrdiff_t>(at), exr.end(), 0) -
                                    exr.begin()) +
           1;
    if (at + 4 > exr.size()) return true;
    const std::size_t length =
        exr[at] | exr[at + 1] << 8U | exr[at + 2] << 16U | std::size_t{exr[at + 3]} << 24U;
    at += 4;
    if (length > exr.size() - at) return true;
    at += length;
  }
  return true;
}

/// Scans of a JPEG; decoding each takes as long as all of its pixels.
int scans_of(std::span<const std::uint8_t> jpeg) {
  int scans = 0;
  for (std::size_t at = 2; at + 4 <= jpeg.size();) {
    const unsigned marker = jpeg[at + 1];
    const bool is_segment =
        jpeg[at] == 0xFF && marker > 1 && marker < 0xFF && !(marker >= 0xD0 && marker <= 0xD9);
    if (is_segment && marker == 0xDA) ++scans;
    at += is_segment ? std::size_t{2} + (jpeg[at + 2] << 8U | jpeg[at + 3]) : 1;
  }
  return scans;
}

/// Loads the module by the RUNPATH of the program or library.
Result<const OpenImageIo*> load_openimageio() {
  static const auto table = []() -> tl::expected<const OpenImageIo*, std::string> {
    void* module = dlopen("libselvedge-openimageio.so", RTLD_NOW | RTLD_LOCAL);
    if (module == nullptr) return tl::unexpected<std::string>(dlerror());
    return static_cast<const OpenImageIo*>(dlsym(module, "selvedge_openimageio"));
  }();
  if (!table) return fail(Code::image_unreadable, "", "", table.error());
  return *table;
}

Result<std::vector<Image>> decode(const char* format, std::span<const std::uint8_t> bytes,
                                  const std::string& name, Transfer transfer, const ImageLimits& limits,
                                  std::span<const int> halvings) {
  // WebP's reader takes canvases of this size when it opens the file.
  constexpr std::uint64_t canvas_bytes = 12;  // of a pixel
  if (format == std::string_view("webp")) {
    const std::uint64_t pixels = picture_pixel_count(bytes);
    if (pixels > static_cast<std::uint64_t>(limits.pixels) ||
        !MemoryBudget(limits.memory).try_spend(pixels, canvas_bytes))
      return fail(Code::file_too_large, name, "", fmt::format("{} pixels", pixels));
  }
  constexpr int max_scans = 100;
  if (format == std::string_view("jpeg") && scans_of(bytes) > max_scans)
    return fail(Code::file_too_large, name, "", fmt::format("has more than {} scans", max_scans));
  if (format == std::string_view("openexr") && declares_more_than_it_has(bytes))
    return fail(Code::image_unreadable, name, "", "ends within its header");
  if (format == std::string_view("hdr"))
    return decode_hdr(bytes, name, limits).map([](Image image) { return std::vector{std::move(image)}; });
  return load_openimageio().and_then([&](const OpenImageIo* library) {
    return library->read(format, bytes, name, transfer, limits, halvings);
  });
}

constexpr std::array whole{0};  ///< halvings of a picture in full size alone
Image first_of(std::vector<Image> images) { return std::move(images.front()); }

}  // namespace

Result<void> check_image_shape(const Image& image, const std::string& name) {
  if (image.width < 1 || image.height < 1 || image.channels < 1 || image.channels > 4)
    return fail(
        Code::image_unwritable, name, "",
        fmt::format("cannot write {} x {} pixels of {} channels", image.width, image.height, image.channels));
  if (image.pixels.size() != std::size_t{1} * image.width * image.height * image.channels)
    return fail(Code::image_unwritable, name, "",
                fmt::format("{} values for {} x {} pixels of {} channels", image.pixels.size(), image.width,
                            image.height, image.channels));
  return {};
}

Result<Image> read_image(const std::string& path, Transfer transfer, std::uint64_t memory) {
  const Result<std::string> file = read_file(path, memory);
  if (!file) return tl::unexpected(file.error());
  const char* format = format_of(*file);
  if (format == nullptr) {
    const std::string_view kind = foreign_file_message(*file);
    return fail(Code::image_unreadable, path, "",
                kind.empty()
                    ? "is no picture of a known kind: PNG, JPEG, WebP, TIFF, OpenEXR, Radiance HDR, PNM"
                    : std::string(kind));
  }
  return decode(format, {reinterpret_cast<const std::uint8_t*>(file->data()), file->size()}, path, transfer,
                {.memory = memory}, whole)
      .map(first_of);
}

Result<std::vector<Image>> decode_levels(std::span<const std::uint8_t> bytes, const std::string& name,
                                         Transfer transfer, const ImageLimits& limits,
                                         std::span<const int> halvings) {
  const char* format = format_of({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  const std::string_view kind = format == nullptr ? "" : format;
  if (kind != "png" && kind != "jpeg" && kind != "webp")
    return fail(Code::image_unreadable, name, "", "neither PNG, JPEG nor WebP");
  return decode(format, bytes, name, transfer, limits, halvings);
}

Result<Image> decode_image(std::span<const std::uint8_t> bytes, const std::string& name, Transfer transfer,
                           const ImageLimits& limits) {
  return decode_levels(bytes, name, transfer, limits, whole).map(first_of);
}

Result<void> write_exr(const std::string& path, const Image& image) {
  if (Result<void> good = check_image_shape(image, path); !good) return good;
  ExrPart part{.width = image.width, .height = image.height};
  ExrPixels pixels{image.width, image.height, {}};
  for (int c = 0; c < image.channels; ++c) {
    part.channels.push_back({std::string(1, (image.channels < 3 ? "YA" : "RGBA")[c]), false});
    std::vector<float>& plane = pixels.planes.emplace_back();
    for (std::size_t i = c; i < image.pixels.size(); i += image.channels) plane.push_back(image.pixels[i]);
  }
  return write_exr_file(path, {part}, [&](int, int) { return std::move(pixels); });
}

}  // namespace selvedge
