#include "converter/make/make.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "converter/make/fallback_factors.h"
#include "converter/stitch/fibres.h"
#include "converter/stitch/textile.h"
#include "fitter/budget/candidates.h"
#include "format/base/guard.h"
#include "format/fabric/json_parts.h"

namespace selvedge {
namespace {

/// Fraction of the budget by Side: light that comes through is smooth.
constexpr std::array<double, all_sides.size()> budget_weights{1, 0.5, 0.4, 0.4};
/// Bytes of a side's parts and members beside its values, about.
constexpr double overhead_of_side = 4500;

/// Fits with layers chosen by level within the budget.
FitResult fit_layers(SideSamples samples, const MakeOptions& options, const Progress& progress) {
  const double texels = samples.header.texels();
  const double growth = options.budget_texels > 0 ? std::max(texels / options.budget_texels, 1.0) : 1;
  const Side side = samples.header.side;
  const double bytes = static_cast<double>(*options.budget) * growth * budget_weights[index_of(side)];
  const bool whole = side == Side::front;
  const auto fitter = value_or_throw(LayerFitter::create(
      std::move(samples.level), samples.header, samples.pairs[index_of(PairKind::validation)], options.fit,
      progress, samples.pairs[index_of(PairKind::measured)],
      whole ? std::numeric_limits<double>::infinity() : bytes - overhead_of_side));
  LayerFit chosen = whole ? value_or_throw(fitter.choose_for_file(bytes, options.write))
                          : fitter.choose(bytes, overhead_of_side);
  return {std::move(chosen.fabric), std::move(chosen.levels), fitter.warnings()};
}

FitResult fit_side(SideSamples samples, const MakeOptions& options, const Progress& progress) {
  if (options.budget) return fit_layers(std::move(samples), options, progress);
  return value_or_throw(
      fit(samples.level, samples.header, options.fit, progress, samples.pairs[index_of(PairKind::measured)]));
}

FitOutcome fit_sides(const Samples& samples, const MakeOptions& options, const Progress& progress) {
  const Stopwatch watch;
  FitOutcome outcome;
  Fabric& fabric = outcome.fabric;
  const std::size_t sides = samples.header.both_sides ? all_sides.size() : 1;
  for (std::size_t i = 0; i < sides; ++i) {
    const Side side = all_sides[i];
    auto fitted = fit_side(samples_of(samples, side), options, [&](double fraction) {
      if (progress) progress((static_cast<double>(i) + fraction) / static_cast<double>(sides));
    });
    fitted.fabric.side = side;
    const PairSamples held_out = pairs_of(samples.pairs[index_of(PairKind::held_out)], side);
    value_or_throw(measure_side(as_stored(fitted.fabric, options.write.half), held_out, outcome.record));
    outcome.levels[i] = std::move(fitted.levels);
    std::move(fitted.warnings.begin(), fitted.warnings.end(), std::back_inserter(outcome.warnings));
    if (side == Side::front) {
      fabric = std::move(fitted.fabric);
      if (samples.header.yarns.curves > 0)
        fabric.levels.front().set_yarns(
            std::make_shared<const Yarns>(samples.yarns, samples.header.period_mm));
    } else {
      fitted.fabric.provenance = "{}";
      fabric.add_side(std::move(fitted.fabric));
    }
  }
  nlohmann::json provenance = provenance_json(with_fit_record(fabric.provenance, outcome.record));
  for (const auto& [name, member] :
       {std::pair("sheet", &fabric.sheet), std::pair("recipe", &fabric.recipe)}) {
    if (!provenance.contains(name)) continue;
    *member = provenance[name].dump();
    provenance.erase(name);
  }
  fabric.provenance = provenance.dump();
  for (const Error& warning : precision_warnings({}, fabric, options.write))
    outcome.warnings.push_back(warning);
  fabric = as_stored(fabric, options.write.half);
  fabric.fallback = text_of(fit_fallback(fabric));
  outcome.seconds = watch.seconds();
  return outcome;
}

}  // namespace

MakeOptions quality_named(std::string_view name) {
  MakeOptions o;
  if (name == "paper") {
    o.bake.truth_samples = 16;  // of 1,024 texels
    return o;
  }
  o.bake.width = o.bake.height = 8;
  o.bake.yarns = true;
  if (name == "draft") {
    o.bake.views = o.bake.lights = 36;
    o.bake.samples = 2;
    o.bake.held_out_pairs = 64;
    o.fit.lobes = 1;
    o.write.half.insert(LayerKind::lobes);
  } else {
    o.budget = 22 << 10;
    o.budget_texels = o.bake.width * o.bake.height;
  }
  return o;
}

Result<FitOutcome> fit_fabric(const Samples& samples, const MakeOptions& options, const Progress& progress) {
  return result_of([&] { return fit_sides(samples, options, progress); });
}

Result<void> set_texels(const V2i& min_texels, int repeats, bool given, const std::string& name,
                        const BakeOptions& asked, BakeOptions& options) {
  constexpr int max_texels = 4096;
  if (!given) {
    options.width = std::max(asked.width * repeats, min_texels.x);
    options.height = std::max(asked.height * repeats, min_texels.y);
  }
  const bool possible = std::max(min_texels.x, min_texels.y) <= max_texels;
  if (possible && options.width >= min_texels.x && options.height >= min_texels.y) return {};
  return fail(Code::option_out_of_range, name, "--texels",
              fmt::format("its yarns need {}x{} texels; {}", min_texels.x, min_texels.y,
                          possible ? fmt::format("{}x{} were asked for", options.width, options.height)
                                   : fmt::format("at most {} a side are made", max_texels)));
}

void share_rays(BakeOptions& options) {
  constexpr int rays_of_pair = 1 << 13;
  const int of_texel = rays_of_pair / (options.width * options.height) / 2 * 2;
  options.truth_samples = std::clamp(of_texel, 2, options.truth_samples);
}

nlohmann::ordered_json recipe_value(const std::string& text) {
  const auto value = nlohmann::ordered_json::parse(text, nullptr, false);
  if (!value.is_number()) return text;
  // 5.0 as a page's script writes it.
  const double number = value;
  const bool whole = value.is_number_float() && std::abs(number) < 1e9 && number == std::floor(number);
  return whole ? nlohmann::ordered_json(std::lround(number)) : value;
}

nlohmann::ordered_json recipe_of(const std::string& name, const FoundStitch& stitch,
                                 nlohmann::ordered_json options) {
  constexpr std::size_t max_text = 1 << 16;
  options["stitch"] = name;
  options.erase("text");
  if (!stitch.text.empty() && stitch.text.size() <= max_text) options["text"] = stitch.text;
  return options;
}

Result<nlohmann::ordered_json> sheet_of(const FoundStitch& stitch, const YarnData& yarns, const V2d& period) {
  const auto numbers = textile_numbers(stitch.pattern, stitch.stitches);
  if (!numbers) return tl::unexpected(numbers.error());
  auto tex = nlohmann::ordered_json::array();
  for (const double of_yarn : numbers->tex) {
    if (const nlohmann::ordered_json number = short_number(of_yarn);
        std::ranges::find(tex, number) == tex.end())
      tex.push_back(number);
  }
  std::string fibres;
  for (const Yarn& yarn : stitch.pattern.yarns) {
    const std::string name = yarn_kinds()[yarn.fibre].name;
    if (fibres.find(name) == std::string::npos) fibres += (fibres.empty() ? "" : ", ") + name;
  }
  nlohmann::ordered_json sheet = {{"composition", fibres},
                                  {"gramsPerSquareMetre", short_number(numbers->weight)},
                                  {"tex", tex},
                                  {"thicknessMm", short_number(numbers->thickness_mm)},
                                  {"cover", short_number(numbers->cover)},
                                  {"coverWithHairs", short_number(numbers->cover_hairs)}};
  const std::array<YarnRuns, 2> runs = Yarns(yarns, V2f(period)).variation().runs;
  if (runs[0].rows > 0 && runs[1].rows > 0) {
    sheet["construction"] = "weave";
    sheet["endsPerCentimetre"] = short_number(runs[1].rows * 10 / period.x);
    sheet["picksPerCentimetre"] = short_number(runs[0].rows * 10 / period.y);
  } else if (stitch.stitches > 0) {
    sheet["construction"] = "knit";
    sheet["walesPerCentimetre"] = short_number(stitch.wales * 10 / period.x);
    sheet["coursesPerCentimetre"] = short_number(stitch.stitches * 10 / (stitch.wales * period.y));
    sheet["tightness"] = short_number(numbers->tightness);
    sheet["stitchesPerSquareCentimetre"] = short_number(stitch.stitches * 100 / (period.x * period.y));
  }
  return sheet;
}

}  // namespace selvedge
