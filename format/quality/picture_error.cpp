#include "format/quality/picture_error.h"

#include <algorithm>
#include <cmath>

#include "format/picture/display.h"
#include "format/quality/ssim.h"

namespace selvedge {
namespace {

/// sRGB-encoded display values in [0, 1].
Image encoded_image(const Frame& frame) {
  Image image = to_display_image(frame, default_display());
  for (float& value : image.pixels) value = linear_to_srgb(value > 0 ? std::min(value, 1.0F) : 0.0F);
  return image;
}

/// The frame at half its size, by means of 2 x 2 pixels.
Frame half_of(const Frame& frame) {
  Frame half{frame.width / 2, frame.height / 2, {}};
  const auto at = [&](int x, int y) { return frame.pixels[std::size_t{1} * y * frame.width + x]; };
  for (int y = 0; y < half.height; ++y) {
    for (int x = 0; x < half.width; ++x) {
      half.pixels.push_back(
          (at(2 * x, 2 * y) + at(2 * x + 1, 2 * y) + at(2 * x, 2 * y + 1) + at(2 * x + 1, 2 * y + 1)) *
          0.25F);
    }
  }
  return half;
}

}  // namespace

Result<PictureError> picture_error(const Frame& frame, const Frame& truth) {
  const Image a = encoded_image(frame);
  const Image b = encoded_image(truth);
  const auto difference = compare_images(a, b);
  if (!difference) return tl::unexpected(difference.error());
  const auto similarity = structural_similarity(a, b);
  if (!similarity) return tl::unexpected(similarity.error());
  return PictureError{difference->rmse * difference->rmse, similarity->value_or(1)};
}

double psnr_of(double mean_square) {
  constexpr double max_psnr = 200;
  return mean_square > 0 ? std::min(max_psnr, -10 * std::log10(mean_square)) : max_psnr;
}

PictureError mean_of(const std::vector<PictureError>& errors) {
  PictureError mean;
  for (const PictureError& error : errors) {
    mean.mean_square += error.mean_square / static_cast<double>(errors.size());
    mean.ssim += error.ssim / static_cast<double>(errors.size());
  }
  return mean;
}

Image thumbnail_of(const std::vector<Frame>& frames) {
  Image strip{0, 0, 3, {}};
  std::vector<Image> images;
  for (const Frame& frame : frames) {
    images.push_back(to_display_image(half_of(frame), default_display()));
    strip.width += images.back().width;
    strip.height = images.back().height;
  }
  for (int y = 0; y < strip.height; ++y) {
    for (const Image& image : images) {
      const auto row = static_cast<std::ptrdiff_t>(image.width) * 3;
      strip.pixels.insert(strip.pixels.end(), image.pixels.begin() + y * row,
                          image.pixels.begin() + (y + 1) * row);
    }
  }
  return strip;
}

}  // namespace selvedge
