// Radiance pictures (.hdr), as environments come, read without OpenImageIO, which takes 0.2 s and 100 MB to
// load.
#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <sstream>
#include <string_view>

#include "format/base/guard.h"
#include "format/base/option_text.h"
#include "format/base/vec.h"
#include "format/picture/chromaticities.h"
#include "format/picture/image.h"

namespace selvedge {
namespace {

struct Header {
  V2i size{0, 0};
  V3d factor{1, 1, 1};  ///< on the stored values
  Chromaticities primaries{};
};

/// The numbers of a line such as "EXPOSURE=2"; 1 to `count`, or none.
std::vector<double> numbers_of(const std::string& line, std::string_view key, std::size_t count) {
  std::vector<double> numbers;
  if (!line.starts_with(key)) return numbers;
  std::istringstream words(line.substr(key.size()));
  for (double number = 0; words >> number;) numbers.push_back(number);
  if (numbers.size() != count) numbers.clear();
  return numbers;
}

/// "-Y 512 +X 1024": rows from the top, pixels from the left.
V2i size_from(std::string_view line) {
  V2i size(0, 0);
  for (const auto& [name, count] : {std::pair("-Y ", &size.y), std::pair("+X ", &size.x)}) {
    if (!line.starts_with(name)) return {0, 0};
    const auto [end, error] = std::from_chars(line.data() + 3, line.data() + line.size(), *count);
    if (error != std::errc()) return {0, 0};
    line.remove_prefix(static_cast<std::size_t>(end - line.data()));
    line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
  }
  return size;
}

/// Reads lines up to the size, and takes them from `bytes`. Exposures and colour corrections are cumulative.
Header header_in(std::span<const std::uint8_t>& bytes, const std::string& file) {
  const auto refuse = [&](std::string why) -> void {
    throw Failure{{Code::image_unreadable, file, "", std::move(why)}};
  };
  Header header;
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  for (std::size_t start = 0, end = 0; (end = text.find('\n', start)) != std::string_view::npos;
       start = end + 1) {
    const std::string line = trimmed(text.substr(start, end - start));
    if (line.starts_with("FORMAT=") && line != "FORMAT=32-bit_rle_rgbe")
      refuse(line + " is not 32-bit_rle_rgbe");
    for (const auto& [key, count] : {std::pair("EXPOSURE=", 1), {"COLORCORR=", 3}}) {
      const auto numbers = numbers_of(line, key, count);
      for (int c = 0; c < (numbers.empty() ? 0 : 3); ++c) {
        const double number = numbers[c % count];
        if (number > 0 && std::isfinite(number)) header.factor[c] *= number;
      }
    }
    if (const auto numbers = numbers_of(line, "PRIMARIES=", 8); !numbers.empty())
      std::ranges::copy(numbers, header.primaries.begin());
    if (!line.starts_with('-') && !line.starts_with('+')) continue;
    header.size = size_from(line);
    if (header.size.x < 1 || header.size.y < 1) refuse(line + " is no size of the form -Y 512 +X 1024");
    bytes = bytes.subspan(end + 1);
    return header;
  }
  refuse("has no line of its size (-Y 512 +X 1024)");
  return header;
}

using Rgbe = std::array<std::uint8_t, 4>;

class Scanlines {
 public:
  Scanlines(std::span<const std::uint8_t> bytes, const std::string& file) : bytes_(bytes), file_(file) {}

  void read(std::span<Rgbe> row) {
    row_ += 1;
    row[0] = next_pixel();
    const Rgbe first = row[0];
    const bool by_components =
        first[0] == 2 && first[1] == 2 && first[2] < 128 && row.size() >= 8 && row.size() < 32768;
    if (!by_components) {
      for (Rgbe& pixel : row.subspan(1)) pixel = next_pixel();
      return;
    }
    if (first[2] * std::size_t{256} + first[3] != row.size()) refuse("is of another width");
    for (int component = 0; component < 4; ++component) {
      for (std::size_t x = 0; x < row.size();) {
        const int code = next();
        const std::size_t count = code > 128 ? code - 128 : code;
        if (count == 0 || count > row.size() - x) refuse("has a run that does not fit");
        const std::uint8_t same = code > 128 ? next() : 0;
        for (const std::size_t end = x + count; x < end; ++x) row[x][component] = code > 128 ? same : next();
      }
    }
  }

 private:
  std::uint8_t next() {
    if (at_ == bytes_.size()) refuse("is cut short");
    return bytes_[at_++];
  }
  Rgbe next_pixel() {
    Rgbe pixel;
    for (std::uint8_t& component : pixel) component = next();
    return pixel;
  }
  [[noreturn]] void refuse(const char* why) const {
    throw Failure{{Code::image_unreadable, file_, "", fmt::format("scanline {} {}", row_, why)}};
  }

  std::span<const std::uint8_t> bytes_;
  const std::string& file_;
  std::size_t at_ = 0;
  int row_ = 0;
};

Image read(std::span<const std::uint8_t> bytes, const std::string& name, const ImageLimits& limits) {
  MemoryBudget budget(limits.memory);
  const bool held = budget.try_spend(bytes.size(), 1);
  const Header header = header_in(bytes, name);
  Image image{header.size.x, header.size.y, 4, {}};
  const std::string size = fmt::format("{} x {} pixels", image.width, image.height);
  const std::int64_t pixels = std::int64_t{image.width} * image.height;
  if (image.width > limits.side || image.height > limits.side || pixels > limits.pixels)
    throw Failure{{Code::file_too_large, name, "", size}};
  if (!held || !budget.try_spend(pixels, sizeof(Rgbe) + 4 * sizeof(float)))
    throw Failure{memory_limit_error(name, "", size, limits.memory)};
  // Scanlines take memory as they come: a header may declare what the file does not have.
  Scanlines scanlines(bytes, name);
  std::vector<Rgbe> stored;
  const auto width = static_cast<std::size_t>(image.width);
  for (int y = 0; y < image.height; ++y) {
    stored.resize(stored.size() + width);
    scanlines.read(std::span(stored).last(width));
  }
  image.pixels.reserve(4 * stored.size());
  for (const Rgbe& pixel : stored) {
    const double unit = pixel[3] == 0 ? 0 : std::ldexp(1, pixel[3] - 136);
    for (int c = 0; c < 3; ++c)
      image.pixels.push_back(static_cast<float>(pixel[c] * (unit / header.factor[c])));
    image.pixels.push_back(1);
  }
  convert_to_rec709(header.primaries, image.pixels);
  return image;
}

}  // namespace

Result<Image> decode_hdr(std::span<const std::uint8_t> bytes, const std::string& name,
                         const ImageLimits& limits) {
  return catch_failure([&] { return read(bytes, name, limits); });
}

}  // namespace selvedge
