#include "fitter/fit_rows.h"

#include <Imath/half.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <limits>
#include <mutex>

#include "fitter/lobes/frame_fit.h"
#include "format/base/parallel.h"
#include "format/samples/pool.h"

namespace selvedge {
namespace {

/// As the file will hold it, so that the lobes are fitted in the very frame they are evaluated in.
V3f in_half_precision(const V3f& v) { return {Imath::half(v.x), Imath::half(v.y), Imath::half(v.z)}; }

template <class T>
void append(std::vector<T>& to, std::vector<T>&& more) {
  if (to.empty()) {
    to = std::move(more);
  } else {
    to.insert(to.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
  }
}

/// Joins rows to those that are there.
void append(SampleLevel& to, SampleLevel&& more) {
  to.width = more.width;
  to.height += more.height;
  to.views = more.views;
  to.lights = more.lights;
  append(to.alpha, std::move(more.alpha));
  append(to.normal, std::move(more.normal));
  append(to.radiance, std::move(more.radiance));
}

void drop_rows(SampleLevel& from, int rows) {
  const std::ptrdiff_t texels = std::ptrdiff_t{from.width} * rows;
  const auto drop = [](auto& values, std::ptrdiff_t count) {
    values.erase(values.begin(), values.begin() + count);
  };
  drop(from.normal, texels);
  drop(from.alpha, texels * from.views);
  drop(from.radiance, texels * from.views * from.lights);
  from.height -= rows;
}

/// Beyond the largest float lies no radiance that a sample can have.
float clamp_to_finite(double value) {
  constexpr auto largest = static_cast<double>(std::numeric_limits<float>::max());
  return static_cast<float>(std::clamp(value, -largest, largest));
}

struct TexelTotals {
  double error = 0;
  double cost = 0;
  double energy = 0;
  double averaged_error = 0;  ///< in the frame of the averaged normal
  int iterations = 0;
  bool converged = true;
  std::size_t views = 0;    ///< that see it
  std::size_t samples = 0;  ///< above its horizon
};

}  // namespace

RowFit::RowFit(const SamplesHeader& header, const FitOptions& options, const Progress& progress,
               TexelFit texel_fit)
    : options_(options),
      progress_(progress),
      texel_fit_(std::move(texel_fit)),
      directions_{directions_of(header.views), directions_of(header.lights), header.views, header.lights} {
  Fabric& fabric = result_.fabric;
  fabric.period_mm = header.period_mm;
  fabric.reference_height = header.reference_height;
  fabric.thickness_mm = header.thickness_mm;
  fabric.views = header.views;
  if (options.light_table) fabric.lights = header.lights;
  const int all = level_count(header.width, header.height);
  const int count = options.levels > 0 ? std::min(options.levels, all) : all;
  levels_.resize(count);
  for (int k = 0; k < count; ++k) {
    FabricLevel level;
    level.width = level_size(header.width, k);
    level.height = level_size(header.height, k);
    const auto texels = static_cast<std::size_t>(level.texels());
    const std::size_t views = directions_.views.size();
    const auto stride = static_cast<std::size_t>(parameter_count(options.lobes));
    level.lobes = LobeLayer{options.lobes, std::vector<float>(texels * 3 * stride)};
    level.frame = FrameLayer{std::vector<V3f>(texels), std::vector<V3f>(texels)};
    level.opacity = OpacityLayer{std::vector<float>(texels * views)};
    if (options.view_table) level.view_table = ViewTableLayer{std::vector<V3f>(texels * views)};
    if (options.light_table) {
      level.light_table = LightTableLayer{std::vector<V3f>(texels * directions_.lights.size(), V3f(1))};
    }
    texels_ += static_cast<double>(texels);
    FitLevelReport report;
    report.width = level.width;
    report.height = level.height;
    result_.levels.push_back(report);
    fabric.levels.push_back(std::move(level));
  }
}

void RowFit::add(std::size_t k, SampleLevel rows) {
  Level& level = levels_[k];
  const int first = level.first + level.waiting.height;
  fit_texels(k, rows, first);
  if (k + 1 == levels_.size()) return;
  const int height = result_.levels[k].height;
  const auto coarse = overlaps(height, level_size(height, 1));
  append(level.waiting, std::move(rows));
  const int end = level.first + level.waiting.height;
  auto ready = static_cast<std::size_t>(level.next_coarse);
  while (ready < coarse.size() && coarse[ready].back().fine < end) ++ready;
  const int count = static_cast<int>(ready) - level.next_coarse;
  if (count == 0) return;
  SampleLevel pooled = pool_rows(level.waiting, level.first, height, level.next_coarse, count);
  level.next_coarse += count;
  const int needed = ready < coarse.size() ? coarse[ready].front().fine : end;
  drop_rows(level.waiting, needed - level.first);
  level.first = needed;
  add(k + 1, std::move(pooled));
}

void RowFit::fit_texels(std::size_t k, const SampleLevel& rows, int first) {
  const auto start = std::chrono::steady_clock::now();
  FabricLevel& level = result_.fabric.levels[k];
  FitLevelReport& report = result_.levels[k];
  const std::size_t views = directions_.views.size();
  const std::size_t lights = directions_.lights.size();
  const auto stride = static_cast<std::size_t>(parameter_count(options_.lobes));
  // Where a level is small its minima cost nothing to search, and its errors are seen from afar.
  constexpr int small = 16;
  constexpr int tiny = 4;
  LobeFitOptions lobe_options;
  lobe_options.channel.view_table = options_.view_table;
  lobe_options.channel.light_table = options_.light_table;
  lobe_options.channel.table = options_.table;
  lobe_options.lobes = options_.lobes;
  lobe_options.starts = options_.starts;
  if (level.texels() <= small) {
    const bool is_tiny = level.texels() <= tiny;
    lobe_options.starts = std::max(is_tiny ? 48 : 16, options_.starts);
    lobe_options.finalists = is_tiny ? 24 : 4;
  }
  lobe_options.max_iterations = options_.max_iterations;
  lobe_options.tolerance = options_.tolerance;

  std::mutex guard;
  std::vector<TexelTotals> totals(static_cast<std::size_t>(rows.texels()));
  parallel_for(0, rows.texels(), [&](int index) {
    const auto from = static_cast<std::size_t>(index);
    const std::size_t texel = static_cast<std::size_t>(first) * static_cast<std::size_t>(level.width) + from;
    // Normals that cancel, and texels never seen, take the cloth's own normal.
    const V3f sum = rows.normal[from];
    const V3f normal = in_half_precision(sum.length() > 1e-4F ? sum.normalized() : V3f(0, 0, 1));
    const V3f tangent = in_half_precision(tangent_of(normal));
    level.frame->normal[texel] = normal;
    level.frame->tangent[texel] = tangent;
    const float* alpha = &rows.alpha[from * views];
    std::copy_n(alpha, views, &level.opacity->opacity[texel * views]);

    const V3f* radiance = &rows.radiance[from * views * lights];
    TexelTotals& total = totals[from];
    std::array<ChannelFit, 3> fits;
    if (options_.frames) {
      FrameFit framed = fit_frame(alpha, radiance, directions_, normal, tangent, lobe_options);
      level.frame->normal[texel] = framed.normal;
      level.frame->tangent[texel] = framed.tangent;
      total.averaged_error = framed.averaged_error;
      fits = std::move(framed.fits);
    }
    const TexelSamples samples =
        gather_texel(alpha, radiance, directions_, level.frame->normal[texel], level.frame->tangent[texel]);
    total.error = total.cost = total.energy = samples.energy_below_horizon;
    for (const double w : samples.weight) total.views += w > 0 ? 1 : 0;
    total.samples = total.views * samples.lights.size();
    if (!options_.frames) fits = texel_fit_(samples, lobe_options);
    for (std::size_t c = 0; c < 3; ++c) {
      const ChannelFit& fit = fits[c];
      total.error += fit.error;
      total.cost += fit.cost;
      total.energy += fit.energy;
      total.iterations += fit.iterations;
      total.converged = total.converged && fit.converged;
      for (std::size_t p = 0; p < stride; ++p) {
        level.lobes->parameters[(texel * 3 + c) * stride + p] = clamp_to_finite(fit.parameters[p]);
      }
      for (std::size_t v = 0; options_.view_table && v < views; ++v) {
        level.view_table->colour[texel * views + v][static_cast<int>(c)] = clamp_to_finite(fit.table[v]);
      }
      for (std::size_t l = 0; l < fit.light_table.size(); ++l) {
        level.light_table->value[texel * lights + l][static_cast<int>(c)] =
            clamp_to_finite(fit.light_table[l]);
      }
    }
    const std::lock_guard lock(guard);
    done_ += 1;
    if (progress_) progress_(done_ / texels_);
  });

  Level& sums = levels_[k];
  const double share = 1 / (3.0 * level.texels());
  for (const TexelTotals& total : totals) {
    sums.error += total.error;
    sums.cost += total.cost;
    sums.energy += total.energy;
    sums.averaged_error += total.averaged_error;
    report.mean_iterations += total.iterations * share;
    report.unconverged += total.converged ? 0 : 1;
    report.unseen += total.views > 0 ? 0 : 1;
    const std::size_t unknowns = stride + (options_.view_table ? total.views : 0) +
                                 (options_.light_table ? directions_.lights.size() : 0) +
                                 (options_.frames ? 3 : 0);
    report.one_view += total.views == 1 && directions_.views.size() > 1 ? 1 : 0;
    report.sparse += total.views > 0 && total.samples < unknowns ? 1 : 0;
  }
  report.cost = sums.energy > 0 ? sums.cost / sums.energy : 0;
  report.averaged_error = sums.energy > 0 ? std::sqrt(sums.averaged_error / sums.energy) : 0;
  report.training_error = sums.energy > 0 ? std::sqrt(sums.error / sums.energy) : 0;
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  report.seconds += seconds;
}

}  // namespace selvedge
