// Bytes -> read_samples(): the header, all views, all pairs, the yarns.
#include "format/samples/samples.h"
#include "tests/fuzz/target.h"

using namespace selvedge;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Result<Samples> samples = read_samples({data, size}, "input", fuzz::exr_limits);
  if (!samples) return 0;
  const SideSamples front = side_samples(*samples, Side::front);
  const auto texels = static_cast<std::size_t>(front.header.texels());
  fuzz::require(front.level.radiance.size() == texels * static_cast<std::size_t>(front.header.views.count()) *
                                                   static_cast<std::size_t>(front.header.lights.count()),
                "a radiance for every texel, view and light");
  for (const PairSamples& pairs : front.pairs)
    fuzz::require(
        pairs.radiance.size() == pairs.alpha.size() && pairs.radiance.size() == pairs.pairs.size() * texels,
        "a radiance for every pair and texel");
  return 0;
}
