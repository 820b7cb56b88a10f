#include "fitter/fit.h"

#include <Imath/half.h>

#include <algorithm>
#include <limits>
#include <mutex>
#include <utility>

#include "fitter/solve/radiance_scale.h"
#include "format/base/parallel.h"
#include "format/fabric/json_io.h"
#include "format/samples/pool.h"

namespace selvedge {
namespace {

/// Rounded as in the file, so that lobes are fitted in the frame in which they are evaluated.
V3f in_half_precision(const V3f& v) { return {Imath::half(v.x), Imath::half(v.y), Imath::half(v.z)}; }

float to_finite_float(double value) {
  constexpr auto largest = static_cast<double>(std::numeric_limits<float>::max());
  return static_cast<float>(std::clamp(value, -largest, largest));
}

/// Small levels take little time, and distant views show their errors.
FitOptions options_of_level(FitOptions options, int texels) {
  constexpr int small = 16;
  constexpr int tiny = 4;
  if (texels > small) return options;
  options.starts = std::max(texels > tiny ? 16 : 48, options.starts);
  options.finalists = texels > tiny ? 4 : 24;
  return options;
}

/// Stores the parameters and the table of a texel.
void store(const std::array<ChannelFit, 3>& fits, std::size_t texel, FabricLevel& level) {
  for (int c = 0; c < 3; ++c) {
    const ChannelFit& fit = fits[c];
    float* parameters = &level.lobes()[(texel * 3 + c) * fit.parameters.size()];
    std::ranges::transform(fit.parameters, parameters, to_finite_float);
    for (std::size_t v = 0; level.has(LayerKind::table) && v < fit.table.size(); ++v)
      level.view_table()[texel * fit.table.size() + v][c] = to_finite_float(fit.table[v]);
  }
}

FabricLevel blank_level(const SampleLevel& samples, const SamplesHeader& header, const FitOptions& options) {
  FabricLevel level;
  level.width = samples.width;
  level.height = samples.height;
  level.add_layer(LayerKind::lobes, 3 * parameter_count(options.lobes));
  // Light that comes through has lost the direction of the surface that it met.
  if (!is_transmission(header.side)) level.add_layer(LayerKind::frame, 6);
  level.add_layer(LayerKind::opacity, samples.views);
  if (options.view_table) level.add_layer(LayerKind::table, 3 * samples.views);
  return level;
}

/// Fits a texel of a level and stores it.
void fit_one(const SampleLevel& from, std::size_t texel, const TexelDirections& directions,
             const FitOptions& options, const TexelFit& texel_fit, FabricLevel& level) {
  const std::size_t views = directions.views.size();
  const float* alpha = &from.alpha[texel * views];
  const V3f* radiance = &from.radiance[texel * views * directions.lights.size()];
  std::copy_n(alpha, views, &level.opacity()[texel * views]);
  // If normals cancel or the texel is never seen, the cloth's normal is used.
  const V3f sum = from.normal_sum[texel];
  TexelFrame frame{{0, 0, 1}, {1, 0, 0}};
  auto& [normal, tangent] = level.has(LayerKind::frame) ? level.frame()[texel] : frame;
  if (level.has(LayerKind::frame)) {
    normal = in_half_precision(sum.length() > 1e-4F ? sum.normalized() : V3f(0, 0, 1));
    tangent = in_half_precision(tangent_of(normal));
  }
  const TexelSamples samples = gather_texel(alpha, radiance, directions, normal, tangent);
  store(texel_fit(samples, options), texel, level);
}

std::string provenance_of(const SamplesHeader& header, const FitOptions& options) {
  nlohmann::json text = provenance_json(header.provenance);
  text["fit"] = {{"lobes", options.lobes},
                 {"viewTable", options.view_table},
                 {"starts", options.starts},
                 {"maxIterations", options.max_iterations},
                 {"tolerance", options.tolerance},
                 {"damping", options.table.damping},
                 {"smoothness", options.table.smoothness},
                 {"lights", {header.lights.columns, header.lights.rows}}};
  return text.dump();
}

}  // namespace

Result<Fabric> fit(const SampleLevel& samples, const SamplesHeader& header, const FitOptions& options,
                   const Progress& progress, const PairSamples& measured, const TexelFit& texel_fit) {
  const TexelDirections directions{cell_directions(header.views), cell_directions(header.lights),
                                   header.views};
  const std::size_t views = directions.views.size();
  const std::size_t texels = header.texels();
  if (samples.width != header.width || samples.height != header.height ||
      samples.normal_sum.size() != texels || samples.alpha.size() != texels * views ||
      samples.radiance.size() != texels * views * directions.lights.size())
    return fail(Code::samples_malformed, {}, "level 0", "the samples have other sizes than the header");

  Fabric fabric;
  fabric.period_mm = header.period_mm;
  fabric.reference_height = header.reference_height;
  fabric.thickness_mm = header.thickness_mm;
  fabric.views = header.views;
  const int levels = level_count(header.width, header.height);
  double all_texels = 0;
  for (int k = 0; k < levels; ++k)
    all_texels += 1.0 * level_size(header.width, k) * level_size(header.height, k);
  double fitted_texels = 0;
  SampleLevel pooled;
  for (int k = 0; k < levels; ++k) {
    if (k > 0) pooled = pool(k > 1 ? pooled : samples);
    const SampleLevel& from = k > 0 ? pooled : samples;
    FabricLevel level = blank_level(from, header, options);
    const FitOptions level_options = options_of_level(options, level.texels());
    std::mutex guard;
    parallel_for(0, level.texels(), [&](std::size_t texel) {
      fit_one(from, texel, directions, level_options, texel_fit, level);
      const std::lock_guard lock(guard);
      fitted_texels += 1;
      if (progress) progress(fitted_texels / all_texels);
    });
    fabric.levels.push_back(std::move(level));
  }
  refit_to_pairs(fabric, measured, header.lights.count(), options);
  set_radiance_scale(fabric);
  fabric.provenance = provenance_of(header, options);
  return fabric;
}

}  // namespace selvedge
