#include "converter/make/make.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "converter/make/fallback_factors.h"
#include "converter/make/pack_yarn.h"
#include "converter/mesh/map_joints.h"
#include "converter/stitch/fibres.h"
#include "converter/stitch/textile.h"
#include "fitter/budget/candidates.h"
#include "format/base/guard.h"
#include "format/base/mip.h"
#include "format/fabric/json_io.h"

namespace selvedge {
namespace {

/// Fraction of the budget by Side: light that comes through is smooth.
constexpr std::array<double, all_sides.size()> budget_weights{1, 0.5, 0.4, 0.4};
/// Bytes of a side's parts and members beside its values, about.
constexpr double overhead_of_side = 4500;
/// Bytes of a file of standard quality without its yarn, for these texels or fewer. More texels have fewer
/// bytes each: they are stitches of a chart, which is seen as yarn where level 0 would be.
constexpr double standard_bytes = 22 << 10;
constexpr double standard_texels = 64;
double growth_of(const SamplesHeader& header) {
  return std::pow(std::max(header.texels() / standard_texels, 1.0), 2.0 / 3);
}

/// A fabric of these sides, the front first.
Fabric joined(const std::vector<Fabric>& sides, const std::shared_ptr<const Yarns>& yarns) {
  Fabric fabric = sides.front();
  if (yarns) fabric.levels.front().set_yarns(yarns);
  for (std::size_t i = 1; i < sides.size(); ++i) {
    Fabric other = sides[i];
    other.side = all_sides[i];
    other.provenance = "{}";
    fabric.add_side(std::move(other));
  }
  return fabric;
}

/// A search for layers that make a file as large as `bytes` lets it be. Sizes of layers are only estimated,
/// so files are counted, and the room for layers is corrected.
struct FileSearch {
  double bytes = 0;
  double room = 0;         ///< of the first try
  double other_bytes = 0;  ///< of texts that are not known yet
  double enough = 0;       ///< a file of this fraction of `bytes` ends the search
  int max_tries = 0;
  double smallest = std::numeric_limits<double>::infinity();  ///< file found

  /// The largest fit found whose layers have at least `min_room`; else empty.
  std::vector<Fabric> largest(const std::vector<LayerFitter>& fitters,
                              const std::shared_ptr<const Yarns>& yarn, const FabricWriteOptions& write,
                              double min_room = -std::numeric_limits<double>::infinity());
  Failure no_room() const {
    return Failure{{Code::option_out_of_range,
                    {},
                    "--bytes",
                    fmt::format("{:.0f} bytes; the smallest file has {:.0f}", bytes, smallest)}};
  }
};

std::vector<Fabric> FileSearch::largest(const std::vector<LayerFitter>& fitters,
                                        const std::shared_ptr<const Yarns>& yarn,
                                        const FabricWriteOptions& write, double min_room) {
  const auto weights_end = budget_weights.begin() + static_cast<std::ptrdiff_t>(fitters.size());
  const double weights = std::accumulate(budget_weights.begin(), weights_end, 0.0);
  std::vector<Fabric> best;
  double best_size = 0;
  double last = 0;
  double next_room = room;
  for (int i = 0; i < max_tries && best_size < enough * bytes; ++i) {
    std::vector<Fabric> fits;
    double estimate = 0;
    for (std::size_t k = 0; k < fitters.size(); ++k) {
      LayerFit chosen = fitters[k].choose_within(next_room * budget_weights[k] / weights);
      estimate += chosen.bytes;
      fits.push_back(std::move(chosen.fabric));
    }
    const double size =
        static_cast<double>(value_or_throw(fabric_file_bytes(joined(fits, yarn), write))) + other_bytes;
    if (size == last) break;
    last = size;
    smallest = std::min(smallest, size);
    if (size <= bytes && size > best_size && next_room >= min_room) {
      best_size = size;
      best = std::move(fits);
    }
    // If the file is too large, the correction has a small margin.
    next_room = bytes - (size - estimate) - (size > bytes ? 0.002 * bytes : 0);
  }
  return best;
}

/// The candidates of a side; `room` is LayerFitter::create()'s.
LayerFitter layer_fitter(SideSamples side, const MakeOptions& options, const Progress& progress,
                         double room) {
  return value_or_throw(LayerFitter::create(std::move(side.level), side.header,
                                            side.pairs[index_of(PairKind::validation)], options.fit, progress,
                                            side.pairs[index_of(PairKind::measured)], room));
}

Fabric fit_side(SideSamples samples, const MakeOptions& options, const Progress& progress) {
  // The text of a recipe takes no bytes from the levels.
  nlohmann::json provenance = provenance_json(samples.header.provenance);
  if (provenance.erase("recipe") > 0) samples.header.provenance = provenance.dump();
  if (!options.chooses_layers && !options.fit.has_map)
    return value_or_throw(fit(samples.level, samples.header, options.fit, progress,
                              samples.pairs[index_of(PairKind::measured)]));
  // Layers are chosen by level within the budget.
  const Side side = samples.header.side;
  const double bytes = standard_bytes * growth_of(samples.header) * budget_weights[index_of(side)];
  // The record of the fit is not known yet.
  const double record = 90 + 210.0 * level_count(samples.level.width, samples.level.height);
  if (side != Side::front) {
    const double room = bytes - overhead_of_side;
    return layer_fitter(std::move(samples), options, progress, room).choose_within(room).fabric;
  }
  std::vector<LayerFitter> fitters;
  fitters.push_back(
      layer_fitter(std::move(samples), options, progress, std::numeric_limits<double>::infinity()));
  FileSearch search{bytes, bytes - LayerFitter::typical_overhead_bytes, record, 0.98, 6};
  std::vector<Fabric> fits = search.largest(fitters, nullptr, options.write);
  if (fits.empty()) throw search.no_room();
  return std::move(fits.front());
}

/// Yarn of fewer bytes: its nodes to 1/256 of the thinnest radius, its light to 1/64.
YarnData rounded(YarnData yarn) {
  float radius = std::numeric_limits<float>::infinity();
  for (const YarnCurve& curve : yarn.curves) radius = std::min(radius, ply_or_yarn_radius(curve));
  const float step = std::exp2(std::floor(std::log2(radius / 256)));
  for (V3f& node : yarn.nodes)
    for (int c = 0; c < 3; ++c) node[c] = step * std::round(node[c] / step);
  for (std::vector<float>* light : {&yarn.station_light, &yarn.light_through}) {
    for (float& value : *light) {
      int power = 0;
      const float mantissa = std::frexp(value, &power);
      value = std::ldexp(std::round(64 * mantissa), power - 6);
    }
  }
  return yarn;
}

/// YarnKind::near_view_psnr, the least of the fibres of the data sheet.
std::optional<double> near_accuracy(const nlohmann::json& provenance) {
  std::optional<double> least;
  // A browser's module ends where nlohmann::json throws.
  const nlohmann::json::json_pointer composition("/sheet/composition");
  if (!provenance.contains(composition) || !provenance[composition].is_string()) return least;
  const auto& fibres = provenance[composition].get_ref<const std::string&>();
  for (const YarnKind& kind : yarn_kinds())
    if (fibres.find(kind.name) != std::string::npos)
      least = std::min(least.value_or(kind.near_view_psnr), kind.near_view_psnr);
  return least;
}

/// The front alone takes its samples with it.
SideSamples samples_of(Samples& samples, Side side) {
  return samples.header.both_sides ? side_samples(samples, side) : take_side_samples(samples, side);
}

using ProgressOfSide = std::function<Progress(std::size_t)>;

/// Fits with the layers that make the whole file as large as options.file_bytes lets it be. Yarn is rounded
/// where levels would have less room than in a file of standard quality, and left out where there is no room.
std::vector<Fabric> fit_whole(Samples& samples, const MakeOptions& options, std::size_t sides,
                              const ProgressOfSide& progress, std::shared_ptr<const Yarns>& yarns,
                              std::vector<std::string>& remarks) {
  const auto bytes = static_cast<double>(*options.file_bytes);
  const double weights =
      std::accumulate(budget_weights.begin(), budget_weights.begin() + static_cast<int>(sides), 0.0);
  std::vector<LayerFitter> fitters;
  for (std::size_t i = 0; i < sides; ++i)
    fitters.push_back(layer_fitter(samples_of(samples, all_sides[i]), options, progress(i),
                                   bytes * budget_weights[i] / weights));
  // Record, fallback and accuracy are not known yet.
  FileSearch search{bytes, bytes / 2, 500, 0.995, 8};
  std::vector<Fabric> fits;
  if (yarns) {
    const double standard_room =
        (standard_bytes - LayerFitter::typical_overhead_bytes) * growth_of(samples.header);
    fits = search.largest(fitters, yarns, options.write, standard_room * weights);
    if (fits.empty() && yarns->data().packing.step == 0) {
      yarns = std::make_shared<const Yarns>(rounded(yarns->data()), yarns->period());
      fits = search.largest(fitters, yarns, options.write);
    }
    if (!fits.empty()) return fits;
    if (options.requires_yarn) throw search.no_room();
    remarks.push_back(
        fmt::format("the yarn has no room in {:.0f} bytes, and is left out: with it the "
                    "smallest file has {:.0f}",
                    bytes, search.smallest));
    yarns = nullptr;
  }
  fits = search.largest(fitters, nullptr, options.write);
  if (fits.empty()) throw search.no_room();
  return fits;
}

FitOutcome fit_sides(Samples& samples, MakeOptions options, const Progress& progress) {
  const Stopwatch watch;
  FitOutcome outcome;
  const YarnMap map = samples.yarns.map;
  options.fit.has_map = !map.empty();
  const std::size_t sides = samples.header.both_sides ? all_sides.size() : 1;
  const ProgressOfSide of_side = [&](std::size_t i) {
    return [&progress, i, sides](double fraction) {
      if (progress) progress((static_cast<double>(i) + fraction) / static_cast<double>(sides));
    };
  };
  std::shared_ptr<const Yarns> yarns;
  if (!map.empty()) join_light(samples.yarns, samples.header.period_mm);
  if (samples.header.yarns.curves > 0)
    yarns = std::make_shared<const Yarns>(packed_if_large(samples.yarns), samples.header.period_mm);
  std::vector<Fabric> fits;
  if (options.file_bytes) fits = fit_whole(samples, options, sides, of_side, yarns, outcome.remarks);
  for (std::size_t i = 0; i < sides; ++i) {
    if (!options.file_bytes) fits.push_back(fit_side(samples_of(samples, all_sides[i]), options, of_side(i)));
    fits[i].side = all_sides[i];
    const PairSamples held_out = side_pairs(samples.pairs[index_of(PairKind::held_out)], all_sides[i]);
    value_or_throw(add_side_accuracy(round_to_stored_precision(fits[i], options.write.half_layers), held_out,
                                     outcome.record));
  }
  Fabric& fabric = outcome.fabric = joined(fits, yarns);
  if (yarns) fabric.period_mm = yarns->repeat();
  nlohmann::json provenance = provenance_json(fabric.provenance);
  const nlohmann::json source = provenance_json(samples.header.provenance);
  for (const auto& [name, member] :
       {std::pair("sheet", &fabric.data_sheet), std::pair("recipe", &fabric.recipe)}) {
    if (source.contains(name)) *member = source[name].dump();
    provenance.erase(name);
  }
  fabric.provenance = provenance.dump();
  nlohmann::json accuracy = nlohmann::json::parse(accuracy_json(outcome.record));
  if (const auto near = near_accuracy(source); yarns && near) accuracy["yarn"] = *near;
  fabric.accuracy = accuracy.dump();
  fabric = round_to_stored_precision(fabric, options.write.half_layers);
  fabric.fallback = fallback_json_text(fit_fallback(fabric));
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
  o.bake.stores_yarns = true;
  o.bake.indirect = IndirectLight::lines;
  if (name == "draft") {
    o.bake.views = o.bake.lights = 36;
    o.bake.samples = 2;
    o.bake.held_out_pairs = 64;
    o.fit.lobes = 1;
    o.write.half_layers.insert(LayerKind::lobes);
  } else {
    o.chooses_layers = true;
  }
  return o;
}

Result<FitOutcome> fit_fabric(Samples samples, const MakeOptions& options, const Progress& progress) {
  return catch_failure([&] { return fit_sides(samples, options, progress); });
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

Result<void> check_room(const StitchSize& size, const std::string& name) {
  // With pieces as long as the radius of the yarn, beside the hairs: measured on charts of 576 to 5,580
  // stitches.
  constexpr double max_length_radii = 720e3;
  if (size.length_radii <= max_length_radii) return {};
  const double times = size.length_radii / max_length_radii;
  return fail(
      Code::stitch_invalid, name, "",
      fmt::format("{} {} have {:.1f} times the yarn that a fabric holds: make a part of at most {:.0f}, or "
                  "set fewer plies",
                  size.crossing_count, size.is_woven ? "crossings" : "stitches", times,
                  size.crossing_count / times));
}

void reduce_pair_samples(BakeOptions& options) {
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
  constexpr std::size_t max_text = 1 << 14;
  // A picture became the text of a chart.
  options["stitch"] = name.ends_with(".png") ? name.substr(0, name.size() - 4) + ".txt" : name;
  options.erase("text");
  if (!stitch.file_text.empty() && stitch.file_text.size() <= max_text) options["text"] = stitch.file_text;
  return options;
}

Result<nlohmann::ordered_json> sheet_of(const FoundStitch& stitch, const YarnData& yarns, const V2d& period) {
  const auto numbers = textile_numbers(stitch.pattern, stitch.stitch_count);
  if (!numbers) return tl::unexpected(numbers.error());
  auto tex = nlohmann::ordered_json::array();
  for (const double of_yarn : numbers->tex)
    if (const nlohmann::ordered_json number = short_number(of_yarn);
        std::ranges::find(tex, number) == tex.end())
      tex.push_back(number);
  std::string fibres;
  for (const Yarn& yarn : stitch.pattern.yarns) {
    const std::string name = yarn_kinds()[yarn.fibre_kind].name;
    if (fibres.find(name) == std::string::npos) fibres += (fibres.empty() ? "" : ", ") + name;
  }
  nlohmann::ordered_json sheet = {{"composition", fibres},
                                  {"gramsPerSquareMetre", short_number(numbers->weight_g_per_m2)},
                                  {"tex", tex},
                                  {"thicknessMm", short_number(numbers->thickness_mm)},
                                  {"cover", short_number(numbers->cover_fraction)},
                                  {"coverWithHairs", short_number(numbers->cover_fraction_with_hairs)}};
  const std::array runs{row_noise_along(yarns, V2f(period), 0), row_noise_along(yarns, V2f(period), 1)};
  if (runs[0].rows > 0 && runs[1].rows > 0) {
    sheet["construction"] = "weave";
    sheet["endsPerCentimetre"] = short_number(runs[1].rows * 10 / period.x);
    sheet["picksPerCentimetre"] = short_number(runs[0].rows * 10 / period.y);
  } else if (stitch.stitch_count > 0) {
    sheet["construction"] = "knit";
    sheet["walesPerCentimetre"] = short_number(stitch.wales * 10 / period.x);
    sheet["coursesPerCentimetre"] = short_number(stitch.stitch_count * 10 / (stitch.wales * period.y));
    sheet["plainWalesPerCentimetre"] = short_number(10 / stitch.plain_mm.x);
    sheet["plainCoursesPerCentimetre"] = short_number(10 / stitch.plain_mm.y);
    sheet["tightness"] = short_number(numbers->tightness);
    sheet["stitchesPerSquareCentimetre"] = short_number(stitch.stitch_count * 100 / (period.x * period.y));
  }
  if (const auto& arranged = stitch.arranged) {
    const V2i& made = arranged->map.kinds;
    sheet["kinds"] = {{"stitches", {made.x, made.y}},
                      {"count", arranged->kind_count},
                      {"missing", arranged->missing_kinds},
                      {"shownBy8", arranged->stitches[0]},
                      {"shownBy4", arranged->stitches[1]},
                      {"shownByRow", arranged->stitches[2]},
                      {"decibels", short_number(arranged->decibels)}};
  }
  return sheet;
}

}  // namespace selvedge
