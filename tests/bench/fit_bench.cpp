// The fit against the best of COUNT (20) random restarts. SAMPLES is a samples file, or a built-in stitch,
// which is baked first (TEXELS a side, 64 views x 64 lights).
//   selvedge-fit-bench restarts [SAMPLES [TEXELS [COUNT]]]
#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <mutex>

#include "converter/bake/bake.h"
#include "converter/stitch/find_cell.h"
#include "fitter/fit.h"
#include "format/base/random.h"
#include "format/quality/compare.h"
#include "tests/bench/need.h"
#include "tests/converter/load_cell.h"

namespace {

using namespace selvedge;
using bench::cpu_seconds;
using bench::need;

struct Input {
  SamplesHeader header;
  SampleLevel level;
  PairSamples held_out;
};

Input load(const std::string& samples, int texels) {
  BakeOptions options;
  options.width = options.height = texels;
  SideSamples front = side_samples(std::filesystem::exists(samples)
                                       ? need(read_samples(samples))
                                       : need(bake(need(load_cell(samples)), samples, options)).samples,
                                   Side::front);
  return {std::move(front.header), std::move(front.level),
          std::move(front.pairs[index_of(PairKind::held_out)])};
}

struct Run {
  Fabric fabric;
  double seconds = 0;  ///< of the processor
  double cost = 0;
};

Run run(const SampleLevel& level, const SamplesHeader& header, const FitOptions& options,
        const TexelFit& texel_fit) {
  Run run;
  std::mutex guard;
  const double start = cpu_seconds();
  run.fabric = need(
      fit(level, header, options, {}, {}, [&](const TexelSamples& samples, const FitOptions& lobe_options) {
        auto fits = texel_fit(samples, lobe_options);
        const std::lock_guard lock(guard);
        for (const ChannelFit& fit : fits) run.cost += fit.cost;
        return fits;
      }));
  run.seconds = cpu_seconds() - start;
  return run;
}

std::array<ChannelFit, 3> restarted(const TexelSamples& samples, const FitOptions& options, int count) {
  std::array<ChannelFit, 3> fits;
  for (int c = 0; c < 3; ++c) {
    ChannelProblem problem(samples, c, options);
    Random random(42, static_cast<std::uint64_t>(problem.weighted_squared_radiance() * 1e6),
                  static_cast<std::uint64_t>(c));
    ChannelState best;
    for (int restart = 0; restart < count; ++restart) {
      ChannelState state;
      state.sizes.assign(static_cast<std::size_t>(options.lobes) + 1, 0.1);
      state.table.assign(samples.view_count, 1);
      for (int lobe = 0; lobe < options.lobes; ++lobe) {
        LobeShape shape;
        double largest = 1e-9;
        for (double& d : shape.direction) largest = std::max(largest, std::abs(d = 2 * random.uniform() - 1));
        for (double& d : shape.direction) d /= largest;
        shape.exponent = std::exp(4 * random.uniform());
        state.shapes.push_back(shape);
      }
      minimise(problem, state, options.tolerance, options.max_iterations);
      if (restart == 0 || state.cost < best.cost) best = state;
    }
    fits[c] = to_channel_fit(samples, c, best);
  }
  return fits;
}

int restarts(const std::string& samples, int texels, int count) {
  const Input input = load(samples, texels);
  const FitOptions options;
  const Run ours = run(input.level, input.header, options, fit_texel);
  const Run best = run(input.level, input.header, options,
                       [&](const TexelSamples& s, const FitOptions& o) { return restarted(s, o, count); });
  const auto a = need(compare(ours.fabric, input.held_out, PairKind::held_out));
  const auto b = need(compare(best.fabric, input.held_out, PairKind::held_out));
  fmt::print(
      "{}: ours {:.1f} s, best of {} restarts for every texel and channel {:.1f} s, cost {:.4f} of it\n",
      samples, ours.seconds, count, best.seconds, ours.cost / best.cost);
  fmt::print("level   texels  held-out dB  of best  difference\n");
  for (std::size_t k = 0; k < a.levels.size(); ++k)
    fmt::print("{:5}  {:>7}  {:11.2f}  {:7.2f}  {:+10.2f}\n", k,
               fmt::format("{}x{}", a.levels[k].width, a.levels[k].height), a.levels[k].psnr,
               b.levels[k].psnr, a.levels[k].psnr - b.levels[k].psnr);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const auto number = [&](int i, int otherwise) { return argc > i ? std::atoi(argv[i]) : otherwise; };
  if (argc > 1 && argv[1] == std::string("restarts"))
    return restarts(argc > 2 ? argv[2] : "plain-knit", number(3, 16), number(4, 20));
  fmt::print(stderr, "usage: selvedge-fit-bench restarts [SAMPLES [TEXELS [COUNT]]]\n");
  return 2;
}
