#include <Imath/half.h>

#include <algorithm>
#include <numeric>

#include "format/base/digest.h"
#include "format/exr/exr.h"

namespace selvedge {

std::string digest_of(const ExrPart& part, const ExrPixels& pixels) {
  std::vector<std::size_t> order(part.channels.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return part.channels[a].name < part.channels[b].name; });
  Digest digest;
  std::vector<Imath::half> halves;
  for (const std::size_t channel : order) {
    const std::vector<float>& plane = pixels.planes[channel];
    if (part.channels[channel].half) {
      halves.assign(plane.begin(), plane.end());
      digest.update(halves.data(), halves.size() * sizeof(Imath::half));
    } else {
      digest.update(plane.data(), plane.size() * sizeof(float));
    }
  }
  return digest.hex();
}

}  // namespace selvedge
