// Bytes -> SamplesReader: the header, the level, all pairs.
#include "format/samples/samples.h"
#include "tests/fuzz/target.h"

using namespace selvedge;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Result<SamplesReader> reader = SamplesReader::open({data, size}, "input", fuzz::exr_limits);
  if (!reader) return 0;
  const SamplesHeader& header = reader->header();
  if (const Result<SampleLevel> level = reader->read_level()) {
    const auto cells = static_cast<std::size_t>(header.texels()) *
                       static_cast<std::size_t>(header.views.count()) *
                       static_cast<std::size_t>(header.lights.count());
    fuzz::require(level->radiance.size() == cells, "a radiance for every texel, view and light");
  }
  for (const PairKind kind : all_pair_kinds) {
    if (const Result<PairSamples> pairs = reader->read_pairs(kind)) {
      fuzz::require(
          pairs->radiance.size() == pairs->alpha.size() &&
              pairs->radiance.size() == pairs->pairs.size() * static_cast<std::size_t>(header.texels()),
          "a radiance for every pair and texel");
    }
  }
  return 0;
}
