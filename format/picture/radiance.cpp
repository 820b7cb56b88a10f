#include "format/picture/radiance.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

#include "format/base/guard.h"
#include "format/base/option_text.h"
#include "format/base/vec.h"

namespace selvedge {
namespace {

/// "-Y 512 +X 1024": rows from the top, pixels from the left. The axis of scanlines comes first.
struct Resolution {
  std::array<char, 2> sign{};
  std::array<char, 2> axis{};
  std::array<int, 2> count{};

  bool is_usual() const { return axis[0] == 'Y' && sign[0] == '-' && sign[1] == '+'; }
  int size(char along) const { return count[axis[0] == along ? 0 : 1]; }
  /// Column (X) or row (Y) of a pixel of a scanline.
  int place(char along, int scanline, int pixel) const {
    const int which = axis[0] == along ? 0 : 1;
    const int at = which == 0 ? scanline : pixel;
    return sign[which] == (along == 'X' ? '+' : '-') ? at : count[which] - 1 - at;
  }
};

std::optional<Resolution> resolution_from(std::string_view line) {
  Resolution r;
  for (int k = 0; k < 2; ++k) {
    line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
    if (line.size() < 3 || (line[0] != '-' && line[0] != '+') || (line[1] != 'X' && line[1] != 'Y'))
      return {};
    r.sign[k] = line[0];
    r.axis[k] = line[1];
    line.remove_prefix(std::min(line.find_first_not_of(" \t", 2), line.size()));
    const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), r.count[k]);
    if (error != std::errc()) return {};
    line.remove_prefix(static_cast<std::size_t>(end - line.data()));
  }
  if (r.axis[0] == r.axis[1] || !trimmed(line).empty()) return {};
  return r;
}

struct Header {
  std::string format;
  V3d exposure{1, 1, 1};
  std::optional<Primaries> primaries;
  Resolution resolution;
  std::vector<std::string> remarks;
};

/// A variable of the header. Exposures are cumulative; what cannot be meant is left out.
void read_variable(const std::string& name, const std::string& value, Header& header) {
  std::vector<double> n;
  for (const char* at = value.c_str();;) {
    char* end = nullptr;
    const double number = std::strtod(at, &end);
    if (end == at) break;
    n.push_back(number);
    at = end;
  }
  if (name == "FORMAT") {
    header.format = value;
  } else if (name == "EXPOSURE" || name == "COLORCORR") {
    n.resize(n.empty() ? 1 : n.size());
    const V3d factor = n.size() < 3 ? V3d(n[0]) : V3d(n[0], n[1], n[2]);
    const double least = std::min({factor.x, factor.y, factor.z});
    if (least > 0 && std::isfinite(factor.length())) {
      header.exposure *= factor;
    } else {
      header.remarks.push_back(fmt::format("{}={} is no exposure, and is left out", name, value));
    }
  } else if (name == "PRIMARIES" && n.size() >= 8) {
    header.primaries.emplace();
    std::copy_n(n.begin(), 8, header.primaries->begin());
  } else if ((name == "GAMMA" || name == "PIXASPECT") && !n.empty() && n[0] != 1) {
    header.remarks.push_back(fmt::format("{}={} is left out", name, value));
  }
}

/// Reads lines up to the resolution, whichever blank ones are among them, and takes them from `bytes`.
Header header_in(std::span<const std::uint8_t>& bytes, const std::string& file) {
  Header header;
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  for (std::size_t start = 0, end = 0; (end = text.find('\n', start)) != std::string_view::npos;
       start = end + 1) {
    const std::string_view whole = text.substr(start, end - start);
    const std::string line = trimmed(whole.substr(0, whole.find_last_not_of('\r') + 1));
    if (const auto resolution = resolution_from(line)) {
      header.resolution = *resolution;
      bytes = bytes.subspan(end + 1);
      return header;
    }
    const std::size_t equals = line.find('=');
    if (line.starts_with('#') || equals == std::string::npos) continue;
    std::string name = trimmed(line.substr(0, equals));
    for (char& c : name) c = static_cast<char>(c >= 'a' && c <= 'z' ? c - 'a' + 'A' : c);
    read_variable(name, trimmed(line.substr(equals + 1)), header);
  }
  throw Failure{{Code::image_unreadable, file, "", "has no line of its size (-Y 512 +X 1024)"}};
}

using Rgbe = std::array<std::uint8_t, 4>;

class Scanlines {
 public:
  Scanlines(std::span<const std::uint8_t> bytes, const std::string& file) : bytes_(bytes), file_(file) {}

  void read(std::span<Rgbe> row) {
    row_ += 1;
    const Rgbe first = next_pixel();
    const bool by_components =
        first[0] == 2 && first[1] == 2 && first[2] < 128 && row.size() >= 8 && row.size() < 32768;
    if (!by_components) return read_pixels(first, row);
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
  /// Pixel by pixel; 1, 1, 1, n repeats the one before n times, and one more right behind it 256 n times.
  void read_pixels(Rgbe pixel, std::span<Rgbe> row) {
    int shift = 0;
    for (std::size_t x = 0;; pixel = next_pixel()) {
      if (pixel[0] == 1 && pixel[1] == 1 && pixel[2] == 1) {
        const std::size_t count = std::size_t{pixel[3]} << std::min(shift, 24);
        if (x == 0 || count > row.size() - x) refuse("has a run that does not fit");
        std::fill_n(row.begin() + static_cast<std::ptrdiff_t>(x), count, row[x - 1]);
        x += count;
        shift += 8;
      } else {
        row[x++] = pixel;
        shift = 0;
      }
      if (x == row.size()) return;
    }
  }
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
  MemoryAccount account(limits.memory);
  const bool held = account.take(bytes.size(), 1);
  Header header = header_in(bytes, name);
  const Resolution& r = header.resolution;
  Image image{r.size('X'), r.size('Y'), 4, {}};
  const std::string size = fmt::format("{} x {} pixels", image.width, image.height);
  if (image.width < 1 || image.height < 1) throw Failure{{Code::image_unreadable, name, "", size}};
  const std::int64_t pixels = std::int64_t{image.width} * image.height;
  if (image.width > limits.side || image.height > limits.side || pixels > limits.pixels)
    throw Failure{{Code::file_too_large, name, "", size}};
  if (!held || !account.take(pixels, sizeof(Rgbe) + 4 * sizeof(float)))
    throw Failure{beyond_memory(name, "", size, limits.memory)};
  const bool xyz = header.format == "32-bit_rle_xyze";
  if (!xyz && header.format != "32-bit_rle_rgbe" && !header.format.empty()) {
    throw Failure{{Code::image_unreadable, name, "",
                   fmt::format("FORMAT={} is neither 32-bit_rle_rgbe nor 32-bit_rle_xyze", header.format)}};
  }
  image.primaries = xyz ? xyz_primaries : header.primaries;
  image.remarks = std::move(header.remarks);
  if (header.format.empty()) image.remarks.emplace_back("has no FORMAT: read as 32-bit_rle_rgbe");
  if (!r.is_usual())
    image.remarks.push_back(fmt::format("its scanlines are in the order {}{} {}{}: turned upright", r.sign[0],
                                        r.axis[0], r.sign[1], r.axis[1]));
  const V3d& e = header.exposure;
  if (e != V3d(1))
    image.remarks.push_back(
        fmt::format("divided by the exposure of its header, {:.4g}, {:.4g}, {:.4g}", e.x, e.y, e.z));
  // Scanlines take memory as they come: a header may declare what the file does not have.
  Scanlines scanlines(bytes, name);
  std::vector<Rgbe> stored;
  for (int i = 0; i < r.count[0]; ++i) {
    stored.resize(stored.size() + static_cast<std::size_t>(r.count[1]));
    scanlines.read(std::span(stored).last(static_cast<std::size_t>(r.count[1])));
  }
  image.pixels.resize(static_cast<std::size_t>(pixels) * 4);
  const Rgbe* from = stored.data();
  for (int i = 0; i < r.count[0]; ++i) {
    for (int j = 0; j < r.count[1]; ++j, ++from) {
      float* pixel =
          &image
               .pixels[4 * (static_cast<std::size_t>(r.place('Y', i, j)) * image.width + r.place('X', i, j))];
      const double unit = (*from)[3] == 0 ? 0 : std::ldexp(1, (*from)[3] - 136);
      for (int c = 0; c < 3; ++c) pixel[c] = static_cast<float>((*from)[c] * unit / e[c]);
      pixel[3] = 1;
    }
  }
  return image;
}

}  // namespace

Result<Image> read_radiance(std::span<const std::uint8_t> bytes, const std::string& name,
                            const ImageLimits& limits) {
  return result_of([&] { return read(bytes, name, limits); });
}

}  // namespace selvedge
