// Pictures of a traced stitch for `selvedge import` (tests/bench/measured):
//
//   selvedge-measured-bench SAMPLES FOLDER COUNT [NOISE [SHIFT]]
//     photographs the first COUNT held-out pairs of SAMPLES, noise as a fraction, shift in pixels
//     (tests/converter/measured)
#include <cstdlib>

#include "tests/bench/need.h"
#include "tests/converter/measured/photographs.h"

int main(int argc, char** argv) {
  using namespace selvedge;
  if (argc < 4) {
    fmt::print(stderr, "selvedge-measured-bench SAMPLES FOLDER COUNT [NOISE [SHIFT]]\n");
    return 2;
  }
  const Samples samples = bench::need(read_samples(argv[1]));
  const PairSamples& pairs = samples.pairs[index_of(PairKind::held_out)];
  test::PhotographOptions options;
  // Pixels about as fine as the texels of the samples.
  options.period = V2d(0.89 * pairs.width, 0.93 * pairs.height);
  options.size = V2i(V2d(2.6, 2.3) * options.period);
  if (argc > 4) options.noise = std::atof(argv[4]);
  if (argc > 5) options.shift = std::atof(argv[5]);
  const auto count = std::min<std::size_t>(std::strtoul(argv[3], nullptr, 10), pairs.pairs.size());
  bench::need(test::photograph(pairs, count, argv[2], options));
  // The width of the sample, for --width.
  fmt::print("{}\n", static_cast<double>(samples.header.period_mm.x) * options.size.x / options.period.x);
  return 0;
}
