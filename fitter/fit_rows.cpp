#include "fitter/fit_rows.h"

#include <Imath/half.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <limits>
#include <mutex>

#include "format/base/parallel.h"
#include "format/samples/pool.h"

namespace selvedge {
namespace {

/// Rounded as in the file, so that lobes are fitted in the frame in which they are evaluated.
V3f in_half_precision(const V3f& v) { return {Imath::half(v.x), Imath::half(v.y), Imath::half(v.z)}; }

template <class T>
void append(std::vector<T>& to, std::vector<T>&& more) {
  if (to.empty()) {
    to = std::move(more);
  } else {
    to.insert(to.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
  }
}

/// Appends rows.
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

float clamp_to_finite(double value) {
  constexpr auto largest = static_cast<double>(std::numeric_limits<float>::max());
  return static_cast<float>(std::clamp(value, -largest, largest));
}

LobeFitOptions lobe_fit_options(const FitOptions& from, int texels_of_level) {
  LobeFitOptions options;
  options.channel.view_table = from.view_table;
  options.channel.table = from.table;
  options.lobes = from.lobes;
  options.starts = from.starts;
  // Small levels take little time, and distant views show their errors.
  constexpr int small = 16;
  constexpr int tiny = 4;
  if (texels_of_level <= small) {
    const bool is_tiny = texels_of_level <= tiny;
    options.starts = std::max(is_tiny ? 48 : 16, from.starts);
    options.finalists = is_tiny ? 24 : 4;
  }
  options.max_iterations = from.max_iterations;
  options.tolerance = from.tolerance;
  return options;
}

/// Stores the parameters and the table of a texel.
void store(const std::array<ChannelFit, 3>& fits, std::size_t texel, FabricLevel& level) {
  for (int c = 0; c < 3; ++c) {
    const ChannelFit& fit = fits[c];
    float* parameters = &level.lobes()[(texel * 3 + c) * fit.parameters.size()];
    std::transform(fit.parameters.begin(), fit.parameters.end(), parameters, clamp_to_finite);
    for (std::size_t v = 0; level.has(LayerKind::table) && v < fit.table.size(); ++v) {
      level.view_table()[texel * fit.table.size() + v][c] = clamp_to_finite(fit.table[v]);
    }
  }
}

}  // namespace

/// Sums for the report of one texel.
struct RowFit::TexelTotals {
  double error = 0;
  double cost = 0;
  double energy = 0;
  int iterations = 0;
  bool converged = true;
  std::size_t views = 0;    ///< that see the texel
  std::size_t samples = 0;  ///< above the texel's horizon
};

RowFit::RowFit(const SamplesHeader& header, const FitOptions& options, const Progress& progress,
               TexelFit texel_fit)
    : options_(options),
      progress_(progress),
      texel_fit_(std::move(texel_fit)),
      directions_{directions_of(header.views), directions_of(header.lights), header.views} {
  Fabric& fabric = result_.fabric;
  fabric.period_mm = header.period_mm;
  fabric.reference_height = header.reference_height;
  fabric.thickness_mm = header.thickness_mm;
  fabric.views = header.views;
  const int all = level_count(header.width, header.height);
  const int count = options.levels > 0 ? std::min(options.levels, all) : all;
  levels_.resize(count);
  for (int k = 0; k < count; ++k) {
    FabricLevel level;
    level.width = level_size(header.width, k);
    level.height = level_size(header.height, k);
    const int views = header.views.count();
    level.add(LayerKind::lobes, 3 * parameter_count(options.lobes));
    // Light that comes through has lost the direction of the surface that it met.
    if (!lets_through(header.side)) level.add(LayerKind::frame, 6);
    level.add(LayerKind::opacity, views);
    if (options.view_table) level.add(LayerKind::table, 3 * views);
    texels_ += level.texels();
    LevelReport report;
    report.width = level.width;
    report.height = level.height;
    report.iterations = 0;
    report.converged = report.at_limit = 0;
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
  std::size_t ready = level.next_coarse;
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

RowFit::TexelTotals RowFit::fit_row_texel(const SampleLevel& rows, std::size_t from,
                                          const LobeFitOptions& options, std::size_t texel,
                                          FabricLevel& level) const {
  const std::size_t views = directions_.views.size();
  const float* alpha = &rows.alpha[from * views];
  const V3f* radiance = &rows.radiance[from * views * directions_.lights.size()];
  std::copy_n(alpha, views, &level.opacity()[texel * views]);
  // If normals cancel or the texel is never seen, the cloth's normal is used.
  const V3f sum = rows.normal[from];
  TexelFrame frame{{0, 0, 1}, {1, 0, 0}};
  auto& [normal, tangent] = level.has(LayerKind::frame) ? level.frame()[texel] : frame;
  if (level.has(LayerKind::frame))
    normal = in_half_precision(sum.length() > 1e-4F ? sum.normalized() : V3f(0, 0, 1));
  if (level.has(LayerKind::frame)) tangent = in_half_precision(tangent_of(normal));

  TexelTotals total;
  const TexelSamples samples = gather_texel(alpha, radiance, directions_, normal, tangent);
  const std::array<ChannelFit, 3> fits = texel_fit_(samples, options);
  store(fits, texel, level);
  total.error = total.cost = total.energy = samples.energy_below_horizon;
  for (const double w : samples.weight) total.views += w > 0 ? 1 : 0;
  total.samples = total.views * samples.lights.size();
  for (const ChannelFit& fit : fits) {
    total.error += fit.error;
    total.cost += fit.cost;
    total.energy += fit.energy;
    total.iterations += fit.iterations;
    total.converged = total.converged && fit.converged;
  }
  return total;
}

void RowFit::fit_texels(std::size_t k, const SampleLevel& rows, int first) {
  const auto start = std::chrono::steady_clock::now();
  FabricLevel& level = result_.fabric.levels[k];
  const LobeFitOptions options = lobe_fit_options(options_, level.texels());
  std::mutex guard;
  std::vector<TexelTotals> totals(rows.texels());
  parallel_for(0, rows.texels(), [&](std::size_t from) {
    const std::size_t texel = first * level.width + from;
    totals[from] = fit_row_texel(rows, from, options, texel, level);
    const std::lock_guard lock(guard);
    fitted_texels_ += 1;
    if (progress_) progress_(fitted_texels_ / texels_);
  });
  report_texels(k, totals);
  result_.levels[k].seconds +=
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void RowFit::report_texels(std::size_t k, const std::vector<TexelTotals>& totals) {
  Level& sums = levels_[k];
  LevelReport& report = result_.levels[k];
  const std::size_t views = directions_.views.size();
  const double share = 1 / (3.0 * result_.fabric.levels[k].texels());
  for (const TexelTotals& total : totals) {
    sums.error += total.error;
    sums.cost += total.cost;
    sums.energy += total.energy;
    *report.iterations += total.iterations * share;
    *(total.converged ? report.converged : report.at_limit) += 1;
    report.unseen += total.views > 0 ? 0 : 1;
    const std::size_t unknowns = parameter_count(options_.lobes) + (options_.view_table ? total.views : 0);
    report.one_view += total.views == 1 && views > 1 ? 1 : 0;
    report.sparse += total.views > 0 && total.samples < unknowns ? 1 : 0;
  }
  report.cost = sums.energy > 0 ? sums.cost / sums.energy : 0;
  report.training_error = sums.energy > 0 ? std::sqrt(sums.error / sums.energy) : 0;
}

}  // namespace selvedge
