#include <Imath/half.h>
#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <memory>
#include <numeric>

#include "format/exr.h"

namespace selvedge {
namespace {

std::string to_hex(const XXH128_hash_t& hash) {
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

}  // namespace

std::string digest_of(const ExrPart& part, const ExrPixels& pixels) {
  std::vector<std::size_t> order(part.channels.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return part.channels[a].name < part.channels[b].name; });
  const std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(XXH3_createState(), &XXH3_freeState);
  XXH3_128bits_reset(state.get());
  std::vector<std::uint16_t> halves;
  for (const std::size_t channel : order) {
    const std::vector<float>& plane = pixels.planes[channel];
    if (part.channels[channel].half) {
      halves.clear();
      for (const float value : plane) halves.push_back(Imath::half(value).bits());
      XXH3_128bits_update(state.get(), halves.data(), halves.size() * sizeof(std::uint16_t));
    } else {
      XXH3_128bits_update(state.get(), plane.data(), plane.size() * sizeof(float));
    }
  }
  return to_hex(XXH3_128bits_digest(state.get()));
}

std::string digest_of(const std::string& text) { return to_hex(XXH3_128bits(text.data(), text.size())); }

}  // namespace selvedge
