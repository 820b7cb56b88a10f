// compare-pictures FIRST SECOND [AGAIN] [--max BOUND] [--json]: how far two pictures of the tests are apart.
// PNG values are compared as stored (sRGB-encoded, 1 is white), EXR values as they are; PSNR is of the
// colours alone; --json has the mean linear values of PNGs, too. AGAIN is the second picture with independent
// noise: PSNR is then by the mean product of the differences to both, to which the noise adds nothing. Exit
// status 1 for a bad picture, or a difference of more than the bound.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "apps/common/report.h"
#include "format/picture/image.h"

namespace selvedge {
namespace {

/// Mean linear value of the colours of a picture with sRGB-encoded values.
double mean_radiance(const Image& image) {
  double sum = 0;
  double count = 0;
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    if (image.channels == 4 && i % 4 == 3) continue;
    const auto x = static_cast<double>(image.pixels[i]);
    sum += x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4);
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

/// PSNR of the first picture's colours. Precondition: all have the same size and channels.
double psnr_without_noise(const Image& first, const Image& second, const Image& again) {
  double sum = 0;
  double count = 0;
  for (std::size_t i = 0; i < first.pixels.size(); ++i) {
    if (first.channels == 4 && i % 4 == 3) continue;
    sum += static_cast<double>((first.pixels[i] - second.pixels[i]) * (first.pixels[i] - again.pixels[i]));
    ++count;
  }
  return 10 * std::log10(count / std::max(sum, 1e-12));
}

int run(const std::vector<std::string>& files, double max, const CommonOptions& common) {
  const std::string& first_path = files[0];
  const std::string& second_path = files[1];
  const auto first = value_or_throw(read_image(first_path, Transfer::keep));
  const auto second =
      value_or_throw(read_image(second_path, Transfer::keep, default_memory_limit - memory_of(first)));
  const auto of_second = [&](Error error) {
    if (error.file.empty()) error.file = second_path;
    return error;
  };
  const ImageDifference d = value_or_throw(compare_images(first, second).map_error(of_second));
  double psnr = d.psnr;
  if (files.size() == 3) {
    const auto again = value_or_throw(read_image(files[2], Transfer::keep));
    value_or_throw(compare_images(second, again));
    psnr = psnr_without_noise(first, second, again);
  }
  const Json json{{"maxAbsolute", d.max_absolute},
                  {"x", d.x},
                  {"y", d.y},
                  {"channel", d.channel},
                  {"rmse", d.rmse},
                  {"psnr", psnr},
                  {"means", {mean_radiance(first), mean_radiance(second)}}};
  report(common, "compare", json,
         fill_pattern(
             "max {maxAbsolute:.6g} at ({x}, {y}) channel {channel}, RMSE {rmse:.6g}, PSNR {psnr:.2f} dB\n",
             json));
  if (d.max_absolute <= max) return 0;
  report_error({Code::image_mismatch, second_path, fmt::format("pixel ({}, {})", d.x, d.y),
                fmt::format("differs from {} by {:.6g}, more than {:.6g}", first_path, d.max_absolute, max)});
  return 1;
}

}  // namespace
}  // namespace selvedge

int main(int argc, char** argv) {
  std::vector<std::string> files;
  double max = HUGE_VAL;
  selvedge::CommonOptions common;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--json") {
      common.json = true;
    } else if (word == "--max" && i + 1 < argc) {
      max = std::atof(argv[++i]);
    } else {
      files.push_back(word);
    }
  }
  if (files.size() != 2 && files.size() != 3) return 2;
  try {
    return selvedge::run(files, max, common);
  } catch (...) {
    selvedge::report_error(selvedge::thrown_error(""));
    return 1;
  }
}
