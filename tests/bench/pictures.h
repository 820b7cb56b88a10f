// How far two frames are apart, as they are shown.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "format/picture/frame.h"

namespace selvedge::bench {

/// A value as a display has it: exposed so that white that faces a light of irradiance 1 is 1, over a grey
/// background, sRGB; 0 to 255. What `selvedge-view render` writes by default, before it is rounded.
inline double displayed(const V4f& pixel, int channel) {
  const double light = std::numbers::pi * static_cast<double>(pixel[channel]);
  const double c = std::clamp(light + 0.18 * (1 - static_cast<double>(pixel.w)), 0.0, 1.0);
  return 255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055);
}

struct PictureDifference {
  double psnr = 0;        ///< dB, over the pixels in which either shows something
  double largest = 0;     ///< of 255
  double beyond_two = 0;  ///< share of these pixels that differ by more than 2 of 255
};

inline PictureDifference difference(const Frame& a, const Frame& b) {
  PictureDifference result;
  double sum = 0;
  double pixels = 0;
  double beyond = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    if (!(a.pixels[i].w > 0 || b.pixels[i].w > 0)) continue;
    double worst = 0;
    for (int c = 0; c < 3; ++c) {
      const double d = std::abs(displayed(a.pixels[i], c) - displayed(b.pixels[i], c));
      worst = std::max(worst, d);
      sum += d * d;
    }
    result.largest = std::max(result.largest, worst);
    beyond += worst > 2 ? 1 : 0;
    pixels += 1;
  }
  result.psnr = -10 * std::log10(sum / (3 * pixels * 255 * 255));
  result.beyond_two = beyond / pixels;
  return result;
}

}  // namespace selvedge::bench
