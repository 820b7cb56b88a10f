#include "fitter/fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "fitter/fit_rows.h"
#include "fitter/refit_to_pairs.h"
#include "fitter/solve/radiance_scale.h"
#include "fitter/training_pairs.h"
#include "format/samples/outliers.h"

namespace selvedge {
namespace {

std::string provenance_of(const SamplesHeader& header, const FitOptions& options) {
  nlohmann::json text = nlohmann::json::parse(header.provenance, nullptr, false);
  if (!text.is_object()) text = nlohmann::json::object();
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

Result<void> check_samples(const SampleLevel& samples, const SamplesHeader& header) {
  const std::size_t texels = header.texels();
  const std::size_t views = header.views.count();
  const std::size_t lights = header.lights.count();
  if (samples.width != header.width || samples.height != header.height || samples.normal.size() != texels ||
      samples.alpha.size() != texels * views || samples.radiance.size() != texels * views * lights) {
    return fail(Code::samples_malformed, {}, "level 0", "the samples are not those of the header");
  }
  const auto refused = [&](std::size_t entry, const std::string& what, float value) {
    const std::size_t texel = entry / views;
    const std::size_t width = header.width;
    return fail(Code::samples_not_finite, {},
                fmt::format("texel {},{}, view {}{}", texel % width, texel / width, entry % views, what),
                fmt::format("sample is {}", value));
  };
  for (std::size_t i = 0; i < samples.alpha.size(); ++i) {
    const float alpha = samples.alpha[i];
    if (!(alpha >= 0 && alpha <= 1)) return refused(i, "", alpha);
    for (std::size_t l = 0; l < lights; ++l) {
      const V3f& radiance = samples.radiance[i * lights + l];
      for (int c = 0; c < 3; ++c) {
        if (radiance[c] >= 0 && std::isfinite(radiance[c])) continue;
        return refused(i, fmt::format(", light {}", l), radiance[c]);
      }
    }
  }
  for (std::size_t i = 0; i < texels; ++i) {
    if (!std::isfinite(samples.normal[i].length2()))
      return refused(i * views, "", samples.normal[i].length());
  }
  return {};
}

/// Adds SAMPLES_SPARSE for views, lights and texels with too few samples.
void warn_of_sparse_samples(const SamplesHeader& header, FitResult& result) {
  const auto warning = [&](std::string place, std::string message) {
    result.warnings.push_back({Code::samples_sparse, {}, std::move(place), std::move(message)});
  };
  for (const auto& [name, grid] : {std::pair{"views", header.views}, {"lights", header.lights}}) {
    if (grid.count() == 1) warning(name, "there is one only: nothing is known of other directions");
  }
  for (std::size_t k = 0; k < result.levels.size(); ++k) {
    const LevelReport& level = result.levels[k];
    const auto warn_of_texels = [&](int texels, const char* fault) {
      if (texels == 0) return;
      warning(fmt::format("level {}", k),
              fmt::format("{} of {} texels {}", texels, level.width * level.height, fault));
    };
    warn_of_texels(level.unseen, "are holes from every view");
    warn_of_texels(level.one_view, "are seen from one view only");
    warn_of_texels(level.sparse, "have fewer samples than parameters and table entries");
  }
}

/// The whole fabric of a result with `levels` levels; nothing if the result is whole.
std::optional<WholeFabric> whole_of(const SamplesHeader& header, int levels, bool partial) {
  WholeFabric whole = header.whole.value_or(WholeFabric{V2i(header.width, header.height), 0});
  whole.levels = partial ? level_count(whole.texels.x, whole.texels.y) : whole.level + levels;
  return whole.levels > levels ? std::optional(whole) : std::nullopt;
}

/// Completes the result after all levels are fitted.
FitResult complete(FitResult result, TrainingPairs& training, const OutlierSearch& outliers,
                   const PairSamples& measured, const SamplesHeader& header, const FitOptions& options,
                   std::chrono::steady_clock::time_point start) {
  refit_to_pairs(result.fabric, measured, header.lights.count(), options);
  set_radiance_scale(result.fabric);
  result.training = training.finish();
  result.fabric.provenance = provenance_of(header, options);
  result.fabric.whole = whole_of(header, static_cast<int>(result.fabric.levels.size()), options.partial);
  result.warnings = outliers.warnings();
  warn_of_sparse_samples(header, result);
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace

Result<FitResult> fit(const SampleLevel& samples, const SamplesHeader& header, const FitOptions& options,
                      const Progress& progress, const PairSamples& measured) {
  const auto start = std::chrono::steady_clock::now();
  if (auto ok = check_samples(samples, header); !ok) return tl::unexpected(ok.error());
  RowFit rows(header, options, progress);
  TrainingPairs training(header);
  OutlierSearch outliers(header);
  training.add(samples);
  outliers.add(samples);
  rows.add(samples);
  return complete(rows.finish(), training, outliers, measured, header, options, start);
}

Result<FitResult> fit(SamplesReader& samples, const FitOptions& options, const Progress& progress) {
  const auto start = std::chrono::steady_clock::now();
  const SamplesHeader& header = samples.header();
  const int count = max_rows(header, options.rows_bytes);
  RowFit rows(header, options, progress);
  TrainingPairs training(header);
  OutlierSearch outliers(header);
  for (int first = 0; first < header.height; first += count) {
    auto read = samples.read_rows(first, std::min(count, header.height - first));
    if (!read) return tl::unexpected(read.error());
    training.add(*read);
    outliers.add(*read);
    rows.add(std::move(*read));
  }
  const auto measured = samples.read_pairs(PairKind::measured);
  if (!measured) return tl::unexpected(measured.error());
  return complete(rows.finish(), training, outliers, *measured, header, options, start);
}

}  // namespace selvedge
