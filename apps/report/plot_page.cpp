#include "apps/report/plot_page.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace selvedge {
namespace {

Image resized(const Image& image, const V2i& size) {
  Image result{size.x, size.y, 3, {}};
  for (int y = 0; y < size.y; ++y) {
    for (int x = 0; x < size.x; ++x) {
      const std::ptrdiff_t row = std::ptrdiff_t{y} * image.height / size.y;
      const std::ptrdiff_t column = std::ptrdiff_t{x} * image.width / size.x;
      const auto pixel = image.pixels.begin() + 3 * (row * image.width + column);
      result.pixels.insert(result.pixels.end(), pixel, pixel + 3);
    }
  }
  return result;
}

}  // namespace

double angle_of(const V3f& direction) {
  return std::acos(std::clamp(static_cast<double>(direction.z), -1.0, 1.0)) * 180 / std::numbers::pi;
}

double azimuth_of(const V3f& direction) {
  const double degrees =
      std::atan2(static_cast<double>(direction.y), static_cast<double>(direction.x)) * 180 / std::numbers::pi;
  return degrees < 0 ? degrees + 360 : degrees;
}

double round_up(double value) {
  if (!(value > 0)) return 1;
  const double unit = std::pow(10, std::floor(std::log10(value)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (value <= step * unit * (1 + 1e-9)) return step * unit;
  }
  return 10 * unit;
}

void Page::picture(const V2d& corner, const V2d& size, const Image& image, std::string title) {
  const V2d hair(1, 1);
  box(corner - hair, size + hair * 2, hairline);
  shapes_.emplace_back(DrawnPicture{V2i(corner), resized(image, V2i(size)), std::move(title)});
}

}  // namespace selvedge
