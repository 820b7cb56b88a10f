// compare-pictures FIRST SECOND [AGAIN] [--max BOUND] [--json]: how far two pictures of the tests are apart.
// PNG values are compared as stored (sRGB-encoded, 1 is white), EXR values as they are; PSNR is of the
// colours alone; --json has the mean linear values of PNGs, too. AGAIN is the second picture with independent
// noise: PSNR is then by the mean product of the differences to both, to which the noise adds nothing. Exit
// status 1 for a bad picture, or a difference of more than the bound.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "apps/common/report.h"
#include "format/base/srgb.h"
#include "format/picture/image.h"

namespace selvedge {
namespace {

int run(const std::vector<std::string>& files, double max, const CommonOptions& common) {
  std::vector<Image> pictures;
  for (const std::string& file : files) {
    pictures.push_back(value_or_throw(read_image(file, Transfer::keep)));
    const Image& first = pictures.front();
    if (pictures.back().pixels.size() != first.pixels.size() || pictures.back().width != first.width)
      throw Failure{{Code::image_mismatch, file, "", "the pictures have different sizes"}};
  }
  double largest = 0;
  double sum = 0;
  double colour_product = 0;
  const std::size_t count = pictures[0].pixels.size();
  const double colours = 0.75 * static_cast<double>(count);
  std::array<double, 2> means{};
  for (std::size_t i = 0; i < count; ++i) {
    const auto difference = [&](const Image& other) {
      const double x = pictures[0].pixels[i];
      const double y = other.pixels[i];
      const bool is_same = x == y || (std::isnan(x) && std::isnan(y));
      return is_same ? 0 : std::isfinite(x - y) ? x - y : HUGE_VAL;
    };
    const double d = difference(pictures[1]);
    largest = std::max(largest, std::abs(d));
    sum += d * d;
    if (i % 4 == 3) continue;
    colour_product += d * difference(pictures.back());
    for (std::size_t k = 0; k < 2; ++k) means[k] += srgb_to_linear(pictures[k].pixels[i]) / colours;
  }
  const Json json{{"maxAbsolute", largest},
                  {"rmse", std::sqrt(sum / static_cast<double>(count))},
                  {"psnr", 10 * std::log10(colours / std::max(colour_product, 1e-12))},
                  {"means", means}};
  report(common, "compare", json,
         fill_pattern("max {maxAbsolute:.6g}, RMSE {rmse:.6g}, PSNR {psnr:.2f} dB\n", json));
  if (largest <= max) return 0;
  report_error({Code::image_mismatch, files[1], "",
                fmt::format("differs from {} by {:.6g}, more than {:.6g}", files[0], largest, max)});
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
