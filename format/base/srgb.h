// The sRGB transfer function of IEC 61966-2-1, for values in [0, 1].
#pragma once

#include <cmath>

namespace selvedge {

inline float srgb_to_linear(float encoded) {
  return encoded <= 0.04045F ? encoded / 12.92F : std::pow((encoded + 0.055F) / 1.055F, 2.4F);
}
inline float linear_to_srgb(float linear) {
  return linear <= 0.0031308F ? linear * 12.92F : 1.055F * std::pow(linear, 1.0F / 2.4F) - 0.055F;
}

}  // namespace selvedge
