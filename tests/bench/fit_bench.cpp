// Costs and quality of the fit, in tables. SAMPLES is a samples file, or a built-in stitch, which is
// baked first (TEXELS a side, 64 views x 64 lights).
//
//   selvedge-fit-bench speed SAMPLES
//     evaluations and time of every level
//   selvedge-fit-bench restarts SAMPLES [TEXELS [COUNT]]
//     against the best of COUNT (20) random restarts
//   selvedge-fit-bench lobes SAMPLES [TEXELS]
//     0 to 4 lobes, with and without table
//   selvedge-fit-bench scale
//     how time grows with texels, samples and lobes
#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <mutex>

#include "converter/bake/bake.h"
#include "converter/stitch/find_cell.h"
#include "fitter/fit.h"
#include "format/base/parallel.h"
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
  SideSamples front = samples_of(std::filesystem::exists(samples)
                                     ? need(read_samples(samples))
                                     : need(bake(need(load_cell(samples)), samples, options)).samples,
                                 Side::front);
  return {std::move(front.header), std::move(front.level),
          std::move(front.pairs[index_of(PairKind::held_out)])};
}

struct Run {
  FitResult result;
  double seconds = 0;  ///< of the processor
  double cost = 0;
};

Run run(const SampleLevel& level, const SamplesHeader& header, const FitOptions& options,
        const TexelFit& texel_fit) {
  Run run;
  std::mutex guard;
  const double start = cpu_seconds();
  run.result = need(fit(level, header, options, {}, {},
                        [&](const TexelSamples& samples, const LobeFitOptions& lobe_options) {
                          auto fits = texel_fit(samples, lobe_options);
                          const std::lock_guard lock(guard);
                          for (const ChannelFit& fit : fits) run.cost += fit.cost;
                          return fits;
                        }));
  run.seconds = cpu_seconds() - start;
  return run;
}

std::array<ChannelFit, 3> restarted(const TexelSamples& samples, const LobeFitOptions& options, int count) {
  std::array<ChannelFit, 3> fits;
  for (int c = 0; c < 3; ++c) {
    ChannelProblem problem(samples, c, options.channel);
    Random random(42, static_cast<std::uint64_t>(problem.energy() * 1e6), static_cast<std::uint64_t>(c));
    ChannelState best;
    for (int restart = 0; restart < count; ++restart) {
      ChannelState state;
      state.sizes.assign(static_cast<std::size_t>(options.lobes) + 1, 0.1);
      state.table.assign(samples.views, 1);
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
    fits[c] = channel_fit(samples, c, best, problem);
  }
  return fits;
}

int speed(const std::string& samples) {
  const Input input = load(samples, 32);
  const Run ours = run(input.level, input.header, {}, fit_texel);
  fmt::print("{:.2f} s of processor ({} threads)\n", ours.seconds, thread_count());
  for (const LevelReport& level : ours.result.levels) {
    fmt::print("  {:>7}: {:6.1f} evaluations per channel, {:.2f} s on the wall\n",
               fmt::format("{}x{}", level.width, level.height), level.iterations, level.seconds);
  }
  return 0;
}

int restarts(const std::string& samples, int texels, int count) {
  const Input input = load(samples, texels);
  const FitOptions options;
  const Run ours = run(input.level, input.header, options, fit_texel);
  const Run best =
      run(input.level, input.header, options,
          [&](const TexelSamples& s, const LobeFitOptions& o) { return restarted(s, o, count); });
  const auto a = need(compare(ours.result.fabric, input.held_out, PairKind::held_out));
  const auto b = need(compare(best.result.fabric, input.held_out, PairKind::held_out));
  fmt::print("{}: ours {:.1f} s, best of {} restarts for every texel and channel {:.1f} s\n", samples,
             ours.seconds, count, best.seconds);
  fmt::print("level   texels  cost of best  squared error of best  held-out dB  of best  difference\n");
  for (std::size_t k = 0; k < a.levels.size(); ++k) {
    const double of_ours = ours.result.levels[k].training_error;
    const double of_best = best.result.levels[k].training_error;
    fmt::print("{:5}  {:>7}  {:12.4f}  {:21.4f}  {:11.2f}  {:7.2f}  {:+10.2f}\n", k,
               fmt::format("{}x{}", a.levels[k].width, a.levels[k].height),
               ours.result.levels[k].cost / best.result.levels[k].cost,
               of_ours * of_ours / (of_best * of_best), a.levels[k].psnr, b.levels[k].psnr,
               a.levels[k].psnr - b.levels[k].psnr);
  }
  return 0;
}

int lobes(const std::string& samples, int texels) {
  const Input input = load(samples, texels);
  fmt::print("lobes  table  processor s  held-out dB by level\n");
  for (const bool table : {true, false}) {
    for (int k = 0; k <= 4; ++k) {
      FitOptions options;
      options.lobes = k;
      options.view_table = table;
      const Run ours = run(input.level, input.header, options, fit_texel);
      std::string figures;
      for (const auto& level : need(compare(ours.result.fabric, input.held_out, PairKind::held_out)).levels) {
        figures += fmt::format(" {:6.2f}", level.psnr);
      }
      fmt::print("{:5}  {:>5}  {:11.1f} {}\n", k, table ? "yes" : "no", ours.seconds, figures);
    }
  }
  return 0;
}

/// Smooth synthetic samples: only the time matters.
Input synthetic(int texels, const DirectionGrid& grid) {
  Input input;
  input.header.width = input.header.height = texels;
  input.header.views = input.header.lights = grid;
  input.level.width = input.level.height = texels;
  input.level.views = input.level.lights = grid.count();
  const auto directions = directions_of(grid);
  for (int t = 0; t < texels * texels; ++t) {
    const float turn = 0.1F * static_cast<float>(t % 37);
    input.level.normal.push_back(V3f(0.3F * std::sin(turn), 0.2F, 1));
    for (const V3f& v : directions) {
      input.level.alpha.push_back(1);
      for (const V3f& l : directions) {
        const float lit = l.x * std::cos(turn) > 0.3F ? 0.5F : 1.0F;
        const float gloss = std::pow(std::max(0.0F, (l + v).normalized().z), 20.0F);
        input.level.radiance.push_back(V3f(0.3F, 0.2F, 0.1F) * (l.z * lit * (1 + v.z)) + V3f(0.1F * gloss));
      }
    }
  }
  return input;
}

int scale() {
  fmt::print("texels  samples each  lobes  processor s  evaluations  ns per sample, lobe and evaluation\n");
  const auto row = [](int texels, const DirectionGrid& grid, int lobe_count) {
    const Input input = synthetic(texels, grid);
    FitOptions options;
    options.lobes = lobe_count;
    const Run ours = run(input.level, input.header, options, fit_texel);
    double evaluations = 0;
    double all = 0;
    for (const LevelReport& level : ours.result.levels) {
      const double channels = 3.0 * level.width * level.height;
      evaluations += level.iterations * channels;
      all += channels;
    }
    const double each = static_cast<double>(grid.count()) * grid.count();
    fmt::print("{:3}x{:<3}  {:11.0f}  {:5}  {:11.2f}  {:11.1f}  {:8.2f}\n", texels, texels, each, lobe_count,
               ours.seconds, evaluations / all, ours.seconds / (evaluations * each * lobe_count) * 1e9);
  };
  for (const int texels : {8, 16, 32}) row(texels, {8, 8}, 2);
  for (const DirectionGrid& grid : {DirectionGrid{4, 4}, DirectionGrid{8, 8}, DirectionGrid{8, 16}}) {
    row(8, grid, 2);
  }
  for (const int lobe_count : {1, 2, 3, 4}) row(16, {8, 8}, lobe_count);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  const std::string samples = argc > 2 ? argv[2] : "plain-knit";
  const auto number = [&](int i, int otherwise) { return argc > i ? std::atoi(argv[i]) : otherwise; };
  if (what == "speed") return speed(samples);
  if (what == "restarts") return restarts(samples, number(3, 16), number(4, 20));
  if (what == "lobes") return lobes(samples, number(3, 32));
  if (what == "scale") return scale();
  fmt::print(stderr, "fit_bench: speed, restarts, lobes or scale\n");
  return 2;
}
