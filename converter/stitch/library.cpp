#include "converter/stitch/library.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>
#include <utility>

#include "converter/stitch/blocking.h"
#include "converter/stitch/chart.h"
#include "converter/stitch/clearance.h"
#include "converter/stitch/fibres.h"
#include "converter/stitch/flat_yarn.h"
#include "converter/stitch/knit.h"
#include "converter/stitch/pattern_json.h"
#include "converter/stitch/sampler.h"
#include "converter/stitch/text_cells.h"
#include "converter/stitch/weave.h"
#include "converter/stitch/wif.h"
#include "converter/stitch/yarn_mesh.h"
#include "format/base/atomic_file.h"
#include "format/base/guard.h"
#include "format/fabric/yarn_hairs.h"

namespace selvedge {
namespace {

/// A stitch that is drawn and then relaxed, with its parameters: built in, or of a chart.
struct BuiltIn {
  StitchInfo info;
  /// The yarns as drawn, before relaxation.
  std::function<DrawnKnit(const StitchValues&)> draw;
  int stitch_count = 0;     ///< of a knit, in a repeat
  int wales = 0;            ///< the same
  bool blocked = false;     ///< KnitChart::blocked
  double free_part = 1;     ///< RelaxOptions::free_part
  std::size_t warps = 0;    ///< of a weave: its first yarns, wefts are behind them; of a knit 0
  StitchSettings settings;  ///< of its chart, where a user sets no others
};

/// Flattening of knitted yarn where nothing presses it but the press that finishes cloth.
constexpr double knit_flattening = 0.6;

/// Prefixes of the parameters of each yarn of a chart.
constexpr std::array<const char*, max_chart_yarns> prefixes{"",       "second_", "third_",   "fourth_",
                                                            "fifth_", "sixth_",  "seventh_", "eighth_"};

StitchParameter length_parameter(const std::string& name, double value, const std::string& meaning) {
  return {name, {value}, min_stitch_mm, max_stitch_mm, meaning};
}

StitchParameter tex_parameter(const std::string& prefix) {
  return {prefix + "tex", {100}, 0.1, 1e6, "its count, g/km: with packing it gives the radius, if set"};
}

StitchParameter slack_parameter() {
  return {"slack", {0}, 0, 2, "air between neighbouring yarns, in radii: yarns lie looser and longer"};
}

void append(std::vector<StitchParameter>& parameters, const std::vector<StitchParameter>& more) {
  parameters.insert(parameters.end(), more.begin(), more.end());
}

void append_yarn(std::vector<StitchParameter>& parameters, const std::string& prefix, int kind,
                 double shorter_mm, Yarn yarn) {
  set_kind(kind, prefix, shorter_mm, yarn);
  append(parameters, yarn_parameters(prefix, yarn));
}

double radius_for(const StitchValues& values, const std::string& name, double gauge) {
  return values.number(name) * (values.is_set(name) ? 1 : gauge);
}

BuiltIn knit(const std::string& description, const ChartText& chart) {
  const KnitChart& drawn = chart.knit;
  BuiltIn stitch;
  stitch.info = {chart.name, description, {}};
  auto& parameters = stitch.info.parameters;
  const double radius_mm = drawn.yarns.front().radius_mm;
  parameters = {length_parameter("wale_mm", drawn.wale_mm, "width of one stitch"),
                length_parameter("course_mm", drawn.course_mm, "height of one course"),
                length_parameter("radius_mm", radius_mm, "of the yarn; not set, it follows the gauge"),
                tex_parameter(""),
                {"tightness",
                 {15},
                 1,
                 100,
                 "root of tex over cm of yarn a stitch: gives wale and course, if set with tex"},
                slack_parameter()};
  append(parameters, blocking_parameters({drawn.wale_mm * static_cast<double>(drawn.rows.front().size()),
                                          drawn.course_mm * static_cast<double>(drawn.rows.size())}));
  if (drawn.yarns.size() > 1)
    parameters.push_back({"float",
                          {1.0 * drawn.max_float},
                          0,
                          1024,
                          "stitches that a yarn may pass behind the cloth before it is caught; 0: any"});
  append(parameters, stitch_parameters(drawn.yarns.front().fibre_kind));
  const auto shorter = [wales = drawn.rows.front().size(), courses = drawn.rows.size()](double wale,
                                                                                        double course) {
    return std::min(wale * static_cast<double>(wales), course * static_cast<double>(courses));
  };
  for (std::size_t k = 0; k < drawn.yarns.size(); ++k) {
    Yarn yarn = drawn.yarns[k];
    const int kind = std::exchange(yarn.fibre_kind, 0);
    if (k > 0) append(parameters, yarn_kind_parameters(prefixes[k], kind));
    append_yarn(parameters, prefixes[k], kind, shorter(drawn.wale_mm, drawn.course_mm), yarn);
    for (const auto& [name, value] : chart.settings[k]) stitch.settings[prefixes[k] + name] = value;
  }
  stitch.wales = static_cast<int>(drawn.rows.front().size());
  stitch.blocked = drawn.blocked;
  stitch.stitch_count = stitch.wales * static_cast<int>(drawn.rows.size());
  stitch.draw = [=](const StitchValues& values) {
    KnitChart set = chart.knit;
    set.wale_mm = values.number("wale_mm");
    set.course_mm = values.number("course_mm");
    if (set.yarns.size() > 1) set.max_float = static_cast<int>(values.number("float"));
    const double gauge = std::min(set.wale_mm / chart.knit.wale_mm, set.course_mm / chart.knit.course_mm);
    for (std::size_t k = 0; k < set.yarns.size(); ++k) {
      Yarn& yarn = set.yarns[k];
      // One setting for all: ratios of thickness stay.
      yarn.radius_mm = radius_for(values, "radius_mm", gauge) * (yarn.radius_mm / radius_mm);
      const int kind = kind_of(values, prefixes[k]);
      if (kind == 0 && yarn.fibre_kind != 0 && !values.is_set("radius_mm"))
        yarn.radius_mm = std::min(yarn.radius_mm, default_radius(set, kind));
      yarn.fibre_kind = 0;
      if (kind != 0) yarn.flattening = knit_flattening;
      apply_flattening(values, prefixes[k], yarn);
      apply_settings(values, prefixes[k], shorter(set.wale_mm, set.course_mm), yarn);
    }
    return draw_knit(set, chart.name);
  };
  return stitch;
}

constexpr int texels_per_stitch = 2;
constexpr int texels_per_yarn = 4;
/// Texels along a side of `cells` stitches or crossings: `fine` for each where these are few, one of many,
/// whose yarn is seen as yarn until it is much finer than a pixel.
int texels_along(double cells, int fine) {
  constexpr double few_texels = 32;
  while (fine > 1 && fine * cells > few_texels) fine /= 2;
  return static_cast<int>(std::ceil(fine * cells - 1e-9));
}

V2i texels_of(const Weave& weave) {
  constexpr double max_yarns = 64;
  V2i texels;
  for (int k = 0; k < 2; ++k) {
    const auto& widths = k == 0 ? weave.warp_spacing_mm : weave.weft_spacing_mm;
    const double sum = std::accumulate(widths.begin(), widths.end(), 0.0);
    texels[k] = texels_along(std::min(sum / *std::ranges::min_element(widths), max_yarns), texels_per_yarn);
  }
  return texels;
}

Yarn coloured(const V3f& albedo, double radius_mm, const Gloss& gloss = {}) {
  return {.radius_mm = radius_mm, .albedo = albedo, .gloss = gloss};
}

/// The warps or wefts of a weave.
std::vector<Yarn> yarns_of(const StitchEntry::Threads& threads, const Gloss& gloss,
                           const StitchValues& values, const std::string& prefix, double gauge,
                           std::size_t count) {
  Yarn yarn = coloured(threads.albedo, radius_for(values, prefix + "_radius_mm", gauge), gloss);
  yarn.fibre_kind = kind_of(values, prefix + "_");
  apply_flattening(values, prefix + "_", yarn);
  std::vector<Yarn> yarns(count, yarn);
  for (std::size_t i = 0; i < count; ++i) yarns[i].name = fmt::format("{} {}", prefix, i + 1);
  return yarns;
}

BuiltIn weave(const StitchEntry& entry) {
  const auto& [rows, fibre, warp, weft, gloss] = entry.drawdown;
  BuiltIn stitch;
  stitch.info = {entry.name, entry.description, {}};
  auto& parameters = stitch.info.parameters;
  parameters = {
      length_parameter("warp_spacing_mm", warp.spacing_mm, "between the middles of neighbouring warp yarns"),
      length_parameter("weft_spacing_mm", weft.spacing_mm, "between the middles of neighbouring weft yarns"),
      length_parameter("warp_radius_mm", warp.radius_mm, "of a warp yarn; not set, it follows the gauge"),
      length_parameter("weft_radius_mm", weft.radius_mm, "of a weft yarn; not set, it follows the gauge"),
      tex_parameter("warp_"),
      tex_parameter("weft_"),
      slack_parameter()};
  const int kind = find_yarn_kind(fibre).value();
  append(parameters, stitch_parameters(kind));
  const double shorter_mm = std::min(warp.spacing_mm * static_cast<double>(rows.front().size()),
                                     weft.spacing_mm * static_cast<double>(rows.size()));
  for (const auto& [prefix, threads] : {std::pair("warp_", warp), std::pair("weft_", weft)}) {
    append(parameters, yarn_kind_parameters(prefix, kind));
    append_yarn(parameters, prefix, kind, shorter_mm, coloured(threads.albedo, threads.radius_mm, gloss));
  }
  stitch.warps = rows.front().size();
  stitch.draw = [name = entry.name, cell = entry.drawdown](const StitchValues& values) {
    const std::size_t columns = cell.rows.front().size();
    const std::size_t picks = cell.rows.size();
    const double warp_spacing_mm = values.number("warp_spacing_mm");
    const double weft_spacing_mm = values.number("weft_spacing_mm");
    const double gauge =
        std::min(warp_spacing_mm / cell.warp.spacing_mm, weft_spacing_mm / cell.weft.spacing_mm);
    Weave weave{yarns_of(cell.warp, cell.gloss, values, "warp", gauge, columns),
                yarns_of(cell.weft, cell.gloss, values, "weft", gauge, picks),
                std::vector(columns, warp_spacing_mm),
                std::vector(picks, weft_spacing_mm),
                {}};
    for (auto row = cell.rows.rbegin(); row != cell.rows.rend(); ++row)
      for (const char c : *row) weave.warp_is_over.push_back(c == '#');
    return DrawnKnit{draw_weave(weave, name)};
  };
  return stitch;
}

BuiltIn built_in_of(const StitchEntry& entry) {
  BuiltIn stitch;
  if (entry.chart_text.empty()) {
    stitch = weave(entry);
  } else {
    ChartText chart = value_or_throw(read_chart(entry.chart_text, entry.name));
    chart.name = entry.name;
    stitch = knit(entry.description, chart);
  }
  stitch.info.cover_fraction = entry.cover_fraction;
  return stitch;
}

const std::vector<BuiltIn>& library() {
  static const std::vector<BuiltIn> stitches = [] {
    std::vector<BuiltIn> all;
    for (const StitchEntry& entry : built_in_entries()) all.push_back(built_in_of(entry));
    return all;
  }();
  return stitches;
}

/// The last setting; refuses a pattern that the settings made invalid.
void set_seed(const StitchValues& values, const std::string& name, StitchPattern& pattern) {
  pattern.seed = static_cast<std::uint32_t>(values.number("seed"));
  value_or_throw(validate(pattern, name));
}

/// Lays the repeats that a cell is to hold; refuses more yarn than a pattern may have.
void lay_repeats(const StitchValues& values, const std::string& name, FoundStitch& found,
                 bool is_rough = false) {
  found.repeats = static_cast<int>(values.number("repeats"));
  found.pattern = repeat_pattern(found.pattern, found.repeats);
  found.min_texels *= found.repeats;
  value_or_throw(validate(found.pattern, name));
  double hairs = 0;
  for (const Yarn& yarn : found.pattern.yarns) hairs += expected_hairs(yarn);
  if (const double kept = cut_hairs(found.pattern, is_rough); kept < 1)
    found.remarks.push_back(
        fmt::format("{:.0f} hairs a repeat are too many: {:.0f} % are kept", hairs, 100 * kept));
}

double shorter_period(const StitchPattern& pattern) {
  return std::min(pattern.period_mm.x, pattern.period_mm.y);
}

/// The settings of woven yarn, whose twist and hairs follow its radius.
void apply_woven_settings(const StitchValues& values, std::size_t warps, StitchPattern& pattern) {
  for (std::size_t y = 0; y < pattern.yarns.size(); ++y)
    apply_settings(values, y < warps ? "warp_" : "weft_", shorter_period(pattern), pattern.yarns[y]);
}

constexpr double rough_work = 8;  ///< work that rough relaxation does in the same time, as a multiple

/// Estimated work of relax(), to which its time is proportional: 5 seconds a million on a core of
/// 2024.
double relaxation_work(const StitchPattern& pattern, bool rough = false) {
  constexpr double points_per_radius = 2.5;
  constexpr double margin = 0.7;  // of the widest yarn, within which neighbours are kept
  double squares = 0;             // of each yarn's number of points, for its smoothing
  V3d points(0, 0, 0);            // of all yarns; times half their width; times its square
  double widest = 0;
  for (const Yarn& yarn : pattern.yarns) {
    const double count = std::max(12.0, points_per_radius * polygon_length(yarn.segments) / yarn.radius_mm);
    squares += count * count;
    points += count * V3d(1, half_width_of(yarn), std::pow(half_width_of(yarn), 2));
    widest = std::max(widest, half_width_of(yarn));
  }
  // Neighbours of a point lie within both half widths and the margin; they are looked for among the points of
  // nine squares that are as wide as the widest of these reaches. In memory a contact is worth fifty.
  const double density = 1 / (pattern.period_mm.x * pattern.period_mm.y);
  const double kept = margin * widest;
  const double squared_reaches =
      2 * points.x * points.z + 2 * points.y * points.y + kept * points.x * (4 * points.y + kept * points.x);
  const double contacts = 0.5 * std::numbers::pi * density * squared_reaches;
  const double looked_at = 9 * density * std::pow((2 + margin) * widest * points.x, 2);
  const double searched = 50 * contacts + 0.1 * looked_at;
  return rough ? searched / rough_work : squares + searched;
}
constexpr double max_relaxation_work = 2e8;

/// The same for a knit, whose time and memory grow with its pieces: 16,384 stitches of the usual yarn have a
/// third of it.
double relaxation_work(const DrawnKnit& knit) {
  constexpr double work_per_radius = 130;
  constexpr double long_loop = 200;  // radii, from which on loops take more steps; usual ones have 30
  double radii = 0;
  for (std::size_t y = 0; y < knit.parts.size(); ++y)
    for (const KnitPart& part : knit.parts[y]) {
      const double length = part.length_mm / knit.pattern.yarns[y].radius_mm;
      radii += length * std::max(1.0, length / long_loop);
    }
  return work_per_radius * radii;
}
constexpr const char* too_much_work =
    "the yarns are too long for their thickness: to relax them would take too long";

/// Settings with radii by the yarns' counts, and the size of a stitch by its tightness.
StitchSettings by_count(const BuiltIn& stitch, StitchSettings settings) {
  const auto values =
      value_or_throw(StitchValues::create(stitch.info.name, stitch.info.parameters, settings));
  const auto refuse = [&](const std::string& name, std::string why) {
    value_or_throw(
        Result<void>(fail(Code::option_out_of_range, stitch.info.name, "--set " + name, std::move(why))));
  };
  for (const std::string prefix : {"", "warp_", "weft_"}) {
    const auto radius = radius_from_tex(values, prefix);
    if (!radius) continue;
    const std::string name = prefix + "radius_mm";
    if (values.is_set(name)) refuse(prefix + "tex", "excludes " + name);
    settings[name] = {*radius};
  }
  if (!values.is_set("tightness")) return settings;
  if (!values.is_set("tex")) refuse("tightness", "needs tex");
  const double length = 10 * std::sqrt(values.number("tex")) / values.number("tightness");
  const double wale = values.number("wale_mm");
  const double course = values.number("course_mm");
  const double scale = length / length_of_knit(wale, course);
  settings.try_emplace("wale_mm", std::vector{scale * wale});
  settings.try_emplace("course_mm", std::vector{scale * course});
  return settings;
}

/// Tells the fraction of their thickness that yarns have.
void tell_thickness(double fraction, FoundStitch& found) {
  found.thickness_fraction = fraction;
  if (fraction < 0.995)
    found.remarks.push_back(
        fmt::format("yarns thinned to {:.2f} of their thickness: there is no more room", fraction));
}

/// Tells the angle of wales that are not upright when free.
void tell_lean(const RelaxResult& rested, FoundStitch& found) {
  if (rested.free_lean == 0) return;
  const double degrees = std::atan(rested.free_lean) * 180 / std::numbers::pi;
  const std::string lean =
      fmt::format("lean {:.0f} degrees to the {}", std::abs(degrees), degrees > 0 ? "right" : "left");
  found.remarks.push_back(
      rested.lean_repeats > 1
          ? fmt::format("wales {}: {} repeats above each other are one", lean, rested.lean_repeats)
          : fmt::format("left to itself its wales would {}: its repeat is blocked straight", lean));
}

/// Tells the size of a chart or draft of `cells` each way, whose repeats are still to be laid.
void tell_size(const StitchValues& values, const V2i& cells, const V2i& min_texels, bool woven,
               const DrawnKnit& drawn, const StartCallback& start, bool is_sampler) {
  if (!start) return;
  const auto repeats = static_cast<int>(values.number("repeats"));
  double radii = 0;
  for (std::size_t y = 0; y < drawn.pattern.yarns.size(); ++y) {
    const Yarn& yarn = drawn.pattern.yarns[y];
    double length = woven ? polygon_length(yarn.segments) : 0;
    if (!woven)
      for (const KnitPart& part : drawn.parts[y]) length += part.length_mm;
    radii += yarn.plies * length / yarn.radius_mm;
  }
  start({cells.x * cells.y * repeats * repeats, woven, min_texels * repeats, repeats,
         radii * repeats * repeats, is_sampler});
}

RelaxOptions relax_options(const StitchValues& values, bool woven, bool thins) {
  // In radii, of woven cloth; a crossing of two round yarns takes 4.
  constexpr double woven_thickness = 5.2;
  constexpr double woven_hold = 0.05;
  return {.gap_radii = values.number("slack"),
          .max_thickness_radii = woven ? woven_thickness : 0,
          .in_plane_restoring = woven ? woven_hold : 0,
          .may_thin = thins};
}

/// `tell`: called with the values and the yarns as drawn, before they come to rest.
Result<FoundStitch> relaxed(const BuiltIn& stitch, StitchSettings settings, const Relaxer& relaxer,
                            const std::function<void(const StitchValues&, const DrawnKnit&)>& tell = {}) {
  settings.insert(stitch.settings.begin(), stitch.settings.end());
  settings = by_count(stitch, std::move(settings));
  const auto values =
      value_or_throw(StitchValues::create(stitch.info.name, stitch.info.parameters, settings));
  const bool woven = stitch.warps > 0;
  const bool given =
      values.is_set("radius_mm") || values.is_set("warp_radius_mm") || values.is_set("weft_radius_mm");
  const auto refuse = [&](std::string why) {
    return fail(Code::option_out_of_range, stitch.info.name,
                woven ? "--set warp_radius_mm, weft_radius_mm" : "--set radius_mm", std::move(why));
  };
  DrawnKnit knit = stitch.draw(values);
  StitchPattern& drawn = knit.pattern;
  set_seed(values, stitch.info.name, drawn);
  if ((woven ? relaxation_work(drawn) : relaxation_work(knit)) > max_relaxation_work)
    return refuse(too_much_work);
  if (tell) tell(values, knit);
  RelaxOptions options = relax_options(values, woven, !given);
  options.parts = std::move(knit.parts);
  if (!woven) options.gauge_mm = {values.number("wale_mm"), values.number("course_mm")};
  if (stitch.blocked) options.blocked_mm = drawn.period_mm;
  options.free_part = stitch.free_part;
  RelaxResult result = woven ? relaxer(drawn, options)
                             : rest_blocked(stitch.info.name, values, drawn, std::move(options), relaxer);
  // Soft yarn of a knit gives way before it is refused.
  const double min_part = woven ? 1 - touching_overlap : 0.85;
  if (given ? result.radius_fraction < min_part : !result.has_settled)
    return refuse(fmt::format(
        "the yarns are too thick for their gauge and slack: there is room for {:.2f} of their radius",
        result.radius_fraction));
  FoundStitch found{.pattern = std::move(result.pattern)};
  tell_thickness(result.radius_fraction, found);
  if (woven) {
    apply_woven_settings(values, stitch.warps, found.pattern);
  } else {
    found.plain_mm = {values.number("wale_mm"), values.number("course_mm")};
    found.part_begins = part_begins_of(found.pattern, result.parts);
    found.steps_to_rest = result.steps;
    found.rest_residual = result.residual;
    tell_lean(result, found);
    found.pattern = close_lean(found.pattern, result.lean, result.lean_repeats);
    if (result.residual > max_rest_residual)
      found.remarks.push_back(fmt::format(
          "the knit was stopped before its rest: its last 20 of {} steps still freed {:.1f} % of its energy",
          result.steps, 100 * result.residual));
    for (Yarn& yarn : found.pattern.yarns)
      yarn.hair_mm = std::min(yarn.hair_mm, 0.99 * shorter_period(found.pattern) / max_hair_length_ratio);
  }
  value_or_throw(validate(found.pattern, stitch.info.name));
  lay_repeats(values, stitch.info.name, found, result.is_edit);
  found.stitch_count = stitch.stitch_count * result.lean_repeats * found.repeats * found.repeats;
  found.wales = stitch.wales * found.repeats;
  return found;
}

/// The stitch of a chart, which gets a name if it has none.
BuiltIn stitch_of(ChartText& chart, const std::string& path) {
  if (chart.name.empty()) chart.name = std::filesystem::path(path).stem().string();
  BuiltIn stitch = knit("", chart);
  stitch.info.name = path;
  return stitch;
}

FoundStitch chart_in(const std::string& text, const std::string& path, StitchSettings settings,
                     const StartCallback& start, const Relaxer& relaxer, const KindLimit& kinds) {
  auto chart = value_or_throw(read_chart(text, path));
  const auto grid = grid_of(chart.knit);
  auto arrangement =
      arranged(grid, chart.knit.rows.size() * chart.knit.rows.front().size(), kinds, settings, path);
  if (arrangement) {
    take_sampler(arrangement->sampler, chart.knit);
    fit_settings(arrangement->map, settings);
  }
  BuiltIn stitch = stitch_of(chart, path);
  if (arrangement)
    stitch.free_part =
        std::min(0.999, stitch_changes(*grid) / std::max(1e-3, stitch_changes(arrangement->sampler)));
  const V2i cells(static_cast<int>(chart.knit.rows.front().size()), static_cast<int>(chart.knit.rows.size()));
  V2i texels = cells;
  if (!arrangement)
    texels = {texels_along(cells.x, texels_per_stitch), texels_along(cells.y, texels_per_stitch)};
  auto found = value_or_throw(
      relaxed(stitch, settings, relaxer, [&](const StitchValues& values, const DrawnKnit& drawn) {
        tell_size(values, cells, texels, false, drawn, start, arrangement.has_value());
      }));
  if (arrangement) turn_by_stitch(arrangement->sampler, found.pattern);
  const int rows = found.stitch_count / (found.wales * found.repeats);  // of all that lean
  found.min_texels =
      arrangement ? cells : V2i(texels.x, texels_along(rows, texels_per_stitch)) * found.repeats;
  if (arrangement) found.remarks.push_back(remark_on(*arrangement));
  found.arranged = std::move(arrangement);
  found.remarks.insert(found.remarks.begin(), chart.remarks.begin(), chart.remarks.end());
  return found;
}

/// A draft has colours, but neither plies nor twist nor gloss.
std::vector<StitchParameter> draft_parameters(const Weave& weave) {
  std::vector<StitchParameter> parameters{slack_parameter()};
  const int kind = find_yarn_kind("cotton").value();
  append(parameters, stitch_parameters(kind));
  for (const auto& [prefix, yarns] : {std::pair("warp_", &weave.warp), std::pair("weft_", &weave.weft)}) {
    append(parameters, yarn_kind_parameters(prefix, kind));
    append_yarn(parameters, prefix, kind, 10, yarns->front());
  }
  return parameters;
}

Result<FoundStitch> draft_in(const std::string& text, const std::string& path, const StitchSettings& settings,
                             const StartCallback& start, const Relaxer& relaxer, const KindLimit& kinds) {
  auto draft = value_or_throw(read_wif(text, path));
  const auto grid = grid_of(draft.weave);
  auto arrangement = arranged(grid, draft.weave.warp_is_over.size(), kinds, settings, path);
  if (arrangement) take_sampler(*grid, arrangement->sampler, draft.weave);
  const auto values = value_or_throw(StitchValues::create(path, draft_parameters(draft.weave), settings));
  FoundStitch found;
  found.min_texels = arrangement ? arrangement->map.kinds : texels_of(draft.weave);
  found.remarks = std::move(draft.remarks);
  const std::string name = draft.title.empty() ? std::filesystem::path(path).stem().string() : draft.title;
  RelaxOptions options = relax_options(values, true, true);
  for (auto [prefix, yarns] :
       {std::pair("warp_", &draft.weave.warp), std::pair("weft_", &draft.weave.weft)}) {
    for (Yarn& yarn : *yarns) {
      yarn.fibre_kind = kind_of(values, prefix);
      apply_flattening(values, prefix, yarn);
    }
  }
  tell_size(values, {static_cast<int>(draft.weave.warp.size()), static_cast<int>(draft.weave.weft.size())},
            found.min_texels, true, {draw_weave(draft.weave, name)}, start, arrangement.has_value());
  constexpr std::size_t finely_relaxed = 144;  // crossings
  options.is_rough = draft.weave.warp_is_over.size() > finely_relaxed;
  double thickness = 1;
  // A part of a large weave tells how thin its yarns have to be: all of them are relaxed once then.
  if (options.is_rough)
    thickness = relaxer(draw_weave(corner_of(draft.weave, 12, 12), name), options).radius_fraction;
  for (auto* yarns : {&draft.weave.warp, &draft.weave.weft})
    for (Yarn& yarn : *yarns) yarn.radius_mm *= thickness;
  const StitchPattern drawn = draw_weave(draft.weave, name);
  // Relaxation makes thick yarns thinner.
  value_or_throw(validate(drawn, path, {.radius_periods = 8}));
  if (relaxation_work(drawn, options.is_rough) > max_relaxation_work)
    return fail(Code::stitch_invalid, path, "", too_much_work);
  RelaxResult result = relaxer(drawn, options);
  thickness *= result.radius_fraction;
  found.pattern = std::move(result.pattern);
  value_or_throw(validate(found.pattern, path));
  apply_woven_settings(values, draft.weave.warp.size(), found.pattern);
  set_seed(values, path, found.pattern);
  tell_thickness(thickness, found);
  lay_repeats(values, path, found);
  if (arrangement) turn_by_stitch(arrangement->sampler, found.pattern);
  if (arrangement) found.remarks.push_back(remark_on(*arrangement));
  found.arranged = std::move(arrangement);
  return found;
}

FoundStitch described_in(const std::string& text, const std::string& path, const StitchSettings& settings) {
  auto pattern = value_or_throw(read_stitch(text, path));
  const auto values = value_or_throw(StitchValues::create(path, stitch_parameters(), settings));
  for (Yarn& yarn : pattern.yarns) {
    apply_flattening(values, "", yarn);
    apply_settings(values, "", shorter_period(pattern), yarn);
  }
  if (values.is_set("seed")) set_seed(values, path, pattern);
  FoundStitch found{.pattern = std::move(pattern)};
  const auto clearance = value_or_throw(minimum_clearance(found.pattern, path));
  constexpr double much = 0.1;  // of a radius
  const double overlap = -clearance / min_half_thickness(found.pattern);
  if (overlap > much)
    found.remarks.push_back(
        fmt::format("yarns overlap by {:.2f} of their radius: more than {} shows", overlap, much));
  lay_repeats(values, path, found);
  return found;
}

const BuiltIn* built_in(const std::string& name) {
  const auto found =
      std::ranges::find(library(), name, [](const BuiltIn& stitch) { return stitch.info.name; });
  return found == library().end() ? nullptr : &*found;
}

}  // namespace

std::vector<StitchInfo> built_in_stitches() {
  std::vector<StitchInfo> infos;
  for (const BuiltIn& stitch : library()) infos.push_back(stitch.info);
  return infos;
}

Result<StitchInfo> describe_stitch(const std::string& name_or_path) {
  return catch_failure([&]() -> StitchInfo {
    if (const BuiltIn* stitch = built_in(name_or_path)) return stitch->info;
    const std::string text = stitch_text_in(name_or_path);
    const StitchText kind = kind_of_text(text, name_or_path);
    if (kind == StitchText::draft) {
      const WifDraft draft = value_or_throw(read_wif(text, name_or_path));
      return {name_or_path, draft.title, draft_parameters(draft.weave)};
    }
    if (kind == StitchText::description)
      return {name_or_path, value_or_throw(read_stitch(text, name_or_path)).name, stitch_parameters()};
    auto chart = value_or_throw(read_chart(text, name_or_path));
    const std::string own_name = chart.name;
    BuiltIn stitch = stitch_of(chart, name_or_path);
    stitch.info.description = own_name;
    for (StitchParameter& parameter : stitch.info.parameters)
      if (const auto set = stitch.settings.find(parameter.name); set != stitch.settings.end())
        parameter.default_value = set->second;
    return stitch.info;
  });
}

nlohmann::ordered_json to_json(const StitchInfo& info) {
  auto list = nlohmann::ordered_json::array();
  for (const StitchParameter& p : info.parameters) {
    list.push_back(
        {{"name", p.name}, {"value", p.default_value}, {"range", {p.min, p.max}}, {"meaning", p.meaning}});
    const auto is_for = [&](const YarnMember& member) { return p.name.ends_with(member.name); };
    if (std::ranges::any_of(yarn_members(), is_for) || p.name.ends_with("flattening"))
      list.back()["byKind"] = true;
  }
  return {{"stitch", info.name}, {"description", info.description}, {"parameters", list}};
}

Result<FoundStitch> find_stitch(const std::string& name_or_path, const StitchSettings& settings,
                                const StartCallback& start, const Relaxer& relaxer, const KindLimit& kinds) {
  return catch_failure([&]() -> Result<FoundStitch> {
    if (const BuiltIn* stitch = built_in(name_or_path)) {
      (void)arranged({}, 0, kinds, settings, name_or_path);
      return relaxed(*stitch, settings, relaxer);
    }
    const std::string text = stitch_text_in(name_or_path);
    const StitchText kind = kind_of_text(text, name_or_path);
    FoundStitch found = kind == StitchText::draft
                            ? value_or_throw(draft_in(text, name_or_path, settings, start, relaxer, kinds))
                        : kind == StitchText::chart
                            ? chart_in(text, name_or_path, settings, start, relaxer, kinds)
                            : described_in(text, name_or_path, settings);
    found.file_text = text;
    return found;
  });
}

Result<FoundStitch> find_stitch(const StitchEntry& entry, const StitchSettings& settings) {
  return catch_failure([&] { return value_or_throw(relaxed(built_in_of(entry), settings, relax)); });
}

}  // namespace selvedge
