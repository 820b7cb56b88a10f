#include "fitter/fit.h"

#include <Imath/half.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>
#include <nlohmann/json.hpp>

#include "fitter/lobe_fit.h"
#include "fitter/texel_samples.h"
#include "fitter/view_table.h"
#include "format/lafortune.h"
#include "format/parallel.h"
#include "format/pool.h"

namespace selvedge {
namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// As the file will hold it, so that the lobes are fitted in the very frame they are evaluated in.
V3f in_half_precision(const V3f& v) { return {Imath::half(v.x), Imath::half(v.y), Imath::half(v.z)}; }

/// One channel of one texel: what the alternation ends with.
struct ChannelFit {
  std::vector<double> parameters;
  std::vector<double> table;
  int rounds = 0;
  bool converged = false;
};

double mean_change(const TexelSamples& samples, const std::vector<double>& a, const std::vector<double>& b) {
  double change = 0;
  double weight = 0;
  for (std::size_t v = 0; v < a.size(); ++v) {
    change += samples.weight[v] * std::abs(a[v] - b[v]);
    weight += samples.weight[v];
  }
  return weight > 0 ? change / weight : 0;
}

/// Radiance over cosine, the scale of the start.
double scale_of(const TexelSamples& samples, int channel) {
  double radiance = 0;
  double cosine = 0;
  for (std::size_t v = 0; v < samples.weight.size(); ++v) {
    for (std::size_t i = samples.first[v]; i < samples.first[v + 1]; ++i) {
      radiance +=
          samples.weight[v] * static_cast<double>(samples.radiance[static_cast<std::size_t>(channel)][i]);
      cosine += samples.weight[v] * static_cast<double>(samples.cosine[i]);
    }
  }
  return cosine > 0 ? radiance / cosine : 0;
}

ChannelFit fit_channel(const TexelSamples& samples, int channel, const FitOptions& options) {
  ChannelFit out;
  out.table.assign(samples.weight.size(), 1);
  LobeFitOptions lobe_options;
  lobe_options.lobes = options.lobes;
  out.parameters = start_parameters(options.lobes, scale_of(samples, channel));
  const double peak = peak_limit(samples, channel);
  ViewTableOptions table_options;
  table_options.damping = options.damping;
  while (true) {
    fit_lobes(samples, channel, out.table, peak, lobe_options, out.parameters);
    ++out.rounds;
    if (!options.view_table) {
      out.converged = true;
      return out;
    }
    const std::vector<double> before = out.table;
    out.table = fit_view_table(samples, channel, out.parameters, options.lobes, table_options);
    normalise(samples, out.table, out.parameters, options.lobes);
    out.converged = mean_change(samples, before, out.table) <= options.table_tolerance;
    if (out.converged || out.rounds >= options.max_rounds) return out;
  }
}

/// Squared error and energy of a finished channel, above the horizon.
void add_error(const TexelSamples& samples, int channel, const ChannelFit& fit, int lobes, double& error,
               double& energy) {
  const std::vector<float> sums = lobe_sums(samples, fit.parameters, lobes);
  for (std::size_t v = 0; v < samples.weight.size(); ++v) {
    for (std::size_t i = samples.first[v]; i < samples.first[v + 1]; ++i) {
      const auto radiance = static_cast<double>(samples.radiance[static_cast<std::size_t>(channel)][i]);
      const double difference = fit.table[v] * static_cast<double>(samples.cosine[i] * sums[i]) - radiance;
      error += samples.weight[v] * difference * difference;
      energy += samples.weight[v] * radiance * radiance;
    }
  }
}

struct TexelTotals {
  double error = 0;
  double energy = 0;
  int rounds = 0;
  bool converged = true;
};

FabricLevel fit_level(const SampleLevel& samples, const DirectionGrid& view_grid,
                      const DirectionGrid& light_grid, const FitOptions& options, FitLevelReport& report,
                      const std::function<void()>& on_texel) {
  const std::vector<V3f> views = directions_of(view_grid);
  const std::vector<V3f> lights = directions_of(light_grid);
  const auto texels = static_cast<std::size_t>(samples.texels());
  const auto stride = static_cast<std::size_t>(parameter_count(options.lobes));

  FabricLevel level;
  level.width = samples.width;
  level.height = samples.height;
  level.lobes = LobeLayer{options.lobes, std::vector<float>(texels * 3 * stride)};
  level.frame = FrameLayer{std::vector<V3f>(texels), std::vector<V3f>(texels)};
  level.opacity = OpacityLayer{samples.alpha};
  if (options.view_table) level.view_table = ViewTableLayer{std::vector<V3f>(texels * views.size())};

  std::vector<TexelTotals> totals(texels);
  parallel_for(0, samples.texels(), [&](int index) {
    const auto texel = static_cast<std::size_t>(index);
    // Normals that cancel, and texels never seen, take the cloth's own normal.
    const V3f sum = samples.normal[texel];
    const V3f normal = in_half_precision(sum.length() > 1e-4F ? sum.normalized() : V3f(0, 0, 1));
    const V3f tangent = in_half_precision(tangent_of(normal));
    level.frame->normal[texel] = normal;
    level.frame->tangent[texel] = tangent;

    const TexelSamples gathered = gather_texel(samples, index, views, lights, normal, tangent);
    totals[texel].error = totals[texel].energy = gathered.unreachable;
    for (int c = 0; c < 3; ++c) {
      const ChannelFit fit = fit_channel(gathered, c, options);
      add_error(gathered, c, fit, options.lobes, totals[texel].error, totals[texel].energy);
      for (std::size_t k = 0; k < stride; ++k) {
        level.lobes->parameters[(texel * 3 + static_cast<std::size_t>(c)) * stride + k] =
            static_cast<float>(fit.parameters[k]);
      }
      for (std::size_t v = 0; options.view_table && v < views.size(); ++v) {
        level.view_table->colour[texel * views.size() + v][c] = static_cast<float>(fit.table[v]);
      }
      totals[texel].rounds = std::max(totals[texel].rounds, fit.rounds);
      totals[texel].converged = totals[texel].converged && fit.converged;
    }
    on_texel();
  });

  double error = 0;
  double energy = 0;
  for (const TexelTotals& t : totals) {
    error += t.error;
    energy += t.energy;
    report.mean_rounds += static_cast<double>(t.rounds) / static_cast<double>(texels);
    report.unconverged += t.converged ? 0 : 1;
  }
  report.width = level.width;
  report.height = level.height;
  report.training_error = energy > 0 ? std::sqrt(error / energy) : 0;
  return level;
}

std::string provenance_of(const SamplesHeader& header, const FitOptions& options) {
  nlohmann::json text = nlohmann::json::parse(header.provenance, nullptr, false);
  if (!text.is_object()) text = nlohmann::json::object();
  text["fit"] = {{"lobes", options.lobes},          {"viewTable", options.view_table},
                 {"maxRounds", options.max_rounds}, {"tableTolerance", options.table_tolerance},
                 {"damping", options.damping},      {"lights", {header.lights.columns, header.lights.rows}}};
  return text.dump();
}

}  // namespace

Result<FitResult> fit(SampleLevel samples, const SamplesHeader& header, const FitOptions& options,
                      const Progress& progress) {
  const int most_lobes = FabricLimits{}.lobes;
  if (options.lobes < 0 || options.lobes > most_lobes) {
    return fail(Code::option_out_of_range, {}, "lobes",
                fmt::format("{} is outside of 0 to {}", options.lobes, most_lobes));
  }
  if (options.max_rounds < 1 || !(options.damping >= 0) || !std::isfinite(options.damping)) {
    return fail(Code::option_out_of_range, {}, "rounds or damping", "must be at least 1, and not negative");
  }
  const auto texels = static_cast<std::size_t>(header.texels());
  const std::size_t seen = texels * static_cast<std::size_t>(header.views.count());
  if (samples.width != header.width || samples.height != header.height || samples.normal.size() != texels ||
      samples.alpha.size() != seen ||
      samples.radiance.size() != seen * static_cast<std::size_t>(header.lights.count())) {
    return fail(Code::samples_malformed, {}, "level 0", "the samples are not those of the header");
  }
  const auto start = std::chrono::steady_clock::now();
  FitResult result;
  result.fabric.period_mm = header.period_mm;
  result.fabric.reference_height = header.reference_height;
  result.fabric.thickness_mm = header.thickness_mm;
  result.fabric.views = header.views;
  result.fabric.provenance = provenance_of(header, options);

  const int levels = level_count(header.width, header.height);
  double total = 0;
  for (int k = 0; k < levels; ++k) total += level_size(header.width, k) * level_size(header.height, k);
  std::mutex guard;
  double done = 0;
  const auto on_texel = [&] {
    const std::lock_guard lock(guard);
    done += 1;
    if (progress) progress(done / total);
  };

  for (int k = 0; k < levels; ++k) {
    if (k > 0) samples = pool(samples);
    const auto level_start = std::chrono::steady_clock::now();
    FitLevelReport report;
    result.fabric.levels.push_back(
        fit_level(samples, header.views, header.lights, options, report, on_texel));
    report.seconds = seconds_since(level_start);
    result.levels.push_back(report);
  }
  result.seconds = seconds_since(start);
  return result;
}

}  // namespace selvedge
