// The light of an environment, pixel by pixel.
#pragma once

#include <vector>

#include "format/picture/environment.h"

namespace selvedge::test {

/// One directional lamp for each pixel, dark ones left out.
inline std::vector<Light> lamps_of(const Environment& environment) {
  std::vector<Light> lamps;
  for (int y = 0; y < environment.height; ++y) {
    const auto factor = static_cast<float>(environment.options.strength * environment.solid_angle(y));
    for (int x = 0; x < environment.width; ++x) {
      const V3f& c = environment.radiance[static_cast<std::size_t>(y) * environment.width + x];
      if (c != V3f(0, 0, 0)) lamps.push_back({environment.direction(x, y), c * factor});
    }
  }
  return lamps;
}

}  // namespace selvedge::test
