#include "apps/selvedge/make.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <filesystem>

#include "apps/selvedge/commands.h"
#include "apps/selvedge/option_groups.h"
#include "converter/stitch/chart.h"
#include "converter/stitch/chart_stitches.h"
#include "converter/stitch/text_fault.h"
#include "converter/stitch/yarn_mesh.h"
#include "format/base/atomic_file.h"
#include "format/base/guard.h"
#include "format/base/option_text.h"
#include "format/base/progress.h"

namespace selvedge {
namespace {

/// Layers whose values belong to no level, though they are stored at level 0.
constexpr LayerSet layers_of_no_level{LayerKind::bases, LayerKind::yarns, LayerKind::indirect};

Json level_json(const Fabric& fabric, const FitOutcome& outcome, const FabricReader& reader, std::size_t k) {
  const std::vector<double>& psnr = outcome.record.psnr[index_of(fabric.side)];
  Json layer_bytes = Json::object();
  std::uint64_t bytes = 0;
  for (const LayerKind layer : all_layers) {
    if (layers_of_no_level.contains(layer) || !fabric.levels[k].has(layer)) continue;
    const std::uint64_t of_layer = reader.packed_bytes(layer, static_cast<int>(k), fabric.side);
    layer_bytes[name_of(layer)] = of_layer;
    bytes += of_layer;
  }
  return {{"level", k},
          {"texels", {fabric.levels[k].width, fabric.levels[k].height}},
          {"layers", layers_text(fabric.levels[k])},
          {"bytes", bytes},
          {"layerBytes", layer_bytes},
          {"heldOutPsnr", k < psnr.size() ? Json(psnr[k]) : Json()}};
}

/// `curves`, `nodes`, and `bytes` of both layers of yarn in the file; null without yarn.
Json yarn_json(const FabricReader& reader) {
  const YarnCounts& yarns = reader.header().shape.yarns;
  if (!reader.header().layer(LayerKind::yarns)) return nullptr;
  return {{"curves", yarns.curves},
          {"nodes", yarns.nodes},
          {"bytes", reader.packed_bytes(LayerKind::yarns, 0) + reader.packed_bytes(LayerKind::indirect, 0)}};
}

/// `output`: the samples file; empty: none.
Json bake_json(const BakeReport& r, const std::string& output) {
  Json json = Json::object();
  if (!output.empty()) json = {{"output", output}, {"bytes", file_size_or_zero(output)}};
  json.update({{"seconds", r.seconds},
               {"coverage", r.coverage},
               {"samples", r.samples},
               {"truthSamples", r.truth_samples},
               {"noise", r.noise},
               {"truthNoise", r.truth_noise},
               {"referenceHeight", r.reference_height},
               {"indirect", name_of(r.indirect)},
               {"remarks", r.remarks}});
  if (r.steps_to_rest > 0) json["rest"] = {{"steps", r.steps_to_rest}, {"residual", r.rest_residual}};
  return json;
}

std::string bake_text(const Json& bake) {
  return fill_pattern("baked in {seconds:.1f} s, {samples} samples, noise {noise:.2g}", bake) +
         (bake.contains("rest")
              ? fill_pattern(", at rest after {steps} steps, residual {residual:.1g}", bake["rest"])
              : "") +
         (bake.contains("output") ? fill_pattern(" -> {output} ({bytes} bytes)\n", bake) : "\n");
}

/// `output`: the fabric file, from which the bytes of levels come and layers. Throws Failure.
Json fit_json(const FitOutcome& outcome, const std::string& output) {
  const auto reader = value_or_throw(FabricReader::open(output));
  Json json = {{"output", output},
               {"bytes", file_size_or_zero(output)},
               {"sharedBytes", reader.packed_bytes(LayerKind::bases, 0)},
               {"yarn", yarn_json(reader)},
               {"peak", outcome.record.peak},
               {"seconds", outcome.seconds},
               {"levels", Json::array()},
               {"sides", Json::object()},
               {"remarks", outcome.remarks}};
  const auto add = [&](const Fabric& side, Json& levels) {
    for (std::size_t k = 0; k < side.levels.size(); ++k)
      levels.push_back(level_json(side, outcome, reader, k));
  };
  add(outcome.fabric, json["levels"]);
  for (const auto& side : outcome.fabric.sides)
    if (side) add(*side, json["sides"][name_of(side->side)]);
  return json;
}

std::string fit_text(const Json& fit) {
  std::string text = table_text(fit["levels"], {{"level", "{level}"},
                                                {"texels", "{texels}"},
                                                {"held-out dB", "{heldOutPsnr:.2f}"},
                                                {"bytes", "{bytes}"},
                                                {"layers", "{layers}"}});
  for (const auto& [side, levels] : fit["sides"].items()) {
    std::string errors;
    std::uint64_t bytes = 0;
    for (const Json& level : levels) {
      errors += (errors.empty() ? "" : ", ") + fill_pattern("{heldOutPsnr:.2f}", level);
      bytes += level["bytes"].get<std::uint64_t>();
    }
    text += fmt::format("{}: held-out {} dB by level, {} bytes\n", side, errors, bytes);
  }
  if (!fit["yarn"].is_null())
    text += fill_pattern("yarn: {curves} curves, {nodes} nodes, {bytes} bytes\n", fit["yarn"]);
  return text + fill_pattern("fitted in {seconds:.1f} s -> {output} ({bytes} bytes)\n", fit);
}

void add_bake(Options& options, MakeCommand& command) {
  BakeOptions& bake = command.options.bake;
  options.begin_group("Bake");
  const std::string texels = fmt::format("Texels of one repeat [{}x{}]", bake.width, bake.height);
  options.text("--texels", "N|WxH", texels, [&bake](const std::string& t) {
    const auto n = parse_integer_list("--texels", t, 'x', 1, 2, "32 or 32x16");
    bake.width = n.front();
    bake.height = n.back();
  });
  options.number("--views", bake.views, "N", "View directions").advanced();
  options.number("--lights", bake.lights, "N", "Light directions").advanced();
  options
      .number("--samples", bake.samples, "N", "Rays, or at least 9 to 36 points of yarn, per texel and view")
      .advanced();
  static constexpr std::array<std::string_view, 2> roads{"lines", "paths"};
  options
      .choice("--indirect", roads, bake.indirect,
              "Light between yarns: along lines through the yarn, or paths on a mesh of it")
      .advanced();
  add_bounces(options, bake.bounces);
  options
      .number("--pairs", bake.held_out_pairs, "N",
              "Random pairs of directions to measure errors by, and as many to choose layers by")
      .advanced();
  options
      .number("--truth-samples", bake.truth_samples, "N", "The same per texel and pair, rounded down to even")
      .advanced();
  static constexpr std::array<std::string_view, 2> sides{"front", "both"};
  options.choice("--sides", sides, bake.both_sides, "both: also the back, for cloth that lets light through");
  static constexpr std::array<std::string_view, 2> on_off{"on", "off"};
  options.choice("--yarns", on_off, "Store the yarn itself: sharp close by",
                 [&bake](std::size_t index) { bake.stores_yarns = index == 0; });
  options.number("--seed", bake.seed, "N", "Same seed, same bytes");
  options.add_check([&options, &command] {
    command.has_texels = options.is_given("--texels");
    command.has_bounces = options.is_given("--bounces");
    command.has_pair_rays = options.is_given("--truth-samples");
  });
}

void add_fit(Options& options, MakeCommand& command) {
  options.begin_group("Fit");
  options.number("--lobes", command.options.fit.lobes, "N", "Lafortune lobes per texel")
      .in_range(0, 16)
      .advanced();
  options.set_flag("--no-table", command.options.fit.view_table, false, "Leave the view table out")
      .advanced();
  options.bytes("--bytes", command.options.file_bytes,
                "The most accurate fabric of at most this size (K, M: KiB, MiB)");
}

/// Declares --quality, which sets the options that are not given.
void add_quality(Options& options, MakeCommand& command) {
  options.begin_group("");
  options.choice(
      "--quality", quality_names,
      fmt::format("draft: quick; paper: the paper's model; other options win over it [{}]", command.quality),
      [&command](std::size_t index) { command.quality = quality_names[index]; });
  options.add_check([&options, &command] {
    const MakeOptions quality = quality_named(command.quality);
    MakeOptions& make = command.options;
    const auto given = [&](const char* name) { return options.is_declared(name) && options.is_given(name); };
    if (!given("--texels")) {
      make.bake.width = quality.bake.width;
      make.bake.height = quality.bake.height;
    }
    if (!given("--views")) make.bake.views = quality.bake.views;
    if (!given("--lights")) make.bake.lights = quality.bake.lights;
    if (!given("--samples")) make.bake.samples = quality.bake.samples;
    if (!given("--pairs")) make.bake.held_out_pairs = quality.bake.held_out_pairs;
    make.bake.validation_pairs = make.bake.held_out_pairs;
    if (!given("--yarns")) make.bake.stores_yarns = quality.bake.stores_yarns;
    // The paper's texels have paths; the light of stored yarn comes along lines.
    if (!given("--indirect"))
      make.bake.indirect = make.bake.stores_yarns ? IndirectLight::lines : quality.bake.indirect;
    options.refuse_if(options.is_declared("input") && make.bake.indirect == IndirectLight::lines &&
                          is_stitch(command.input),
                      "needs --indirect paths", {"--bounces"});
    if (!given("--lobes")) make.fit.lobes = quality.fit.lobes;
    make.write = quality.write;
    make.requires_yarn = given("--yarns");
    // Without a table by name, layers are not chosen.
    make.chooses_layers = quality.chooses_layers && !given("--no-table") && !given("--bytes");
  });
}

/// Notes the options that the fabric depends on.
void add_recipe(Options& options, MakeCommand& command) {
  options.add_check([&options, &command] {
    for (const std::string& setting : options.given_texts("--set")) {
      const std::size_t equals = setting.find('=');
      command.recipe["set"][setting.substr(0, equals)] = recipe_value(setting.substr(equals + 1));
    }
    for (const std::string name : recipe_option_names)
      for (const std::string& text : options.given_texts(("--" + name).c_str()))
        command.recipe[name] = recipe_value(text);
    for (const std::string& text : options.given_texts("--float"))
      command.recipe["set"]["float"] = recipe_value(text);
    for (const std::string& text : options.given_texts("--period")) {
      command.recipe["set"]["width_mm"] = recipe_value(text.substr(0, text.find('x')));
      command.recipe["set"]["height_mm"] = recipe_value(text.substr(text.find('x') + 1));
    }
    if (command.options.file_bytes) command.recipe["bytes"] = *command.options.file_bytes;
  });
}

/// CPU seconds that this processor takes now for a second's work of the one that report_estimate() was
/// measured on.
double relative_cpu_time() {
  constexpr double measured = 0.0016;
  double least = 1;
  std::vector<float> field(std::size_t{1} << 19, 1.0F);
  float sum = 0;
  for (int run = 0; run < 4; ++run) {
    const std::clock_t begin = std::clock();
    std::uint32_t at = 1;
    for (int k = 0; k < 200'000; ++k) {
      at = at * 1664525 + 1013904223;
      float& x = field[at >> 13];
      x = 0.5F * std::sqrt(x * x + sum + 1);
      sum = 0.5F * sum + x;
    }
    // The sum, about 2, is in use, so that the work is done.
    if (sum > 1) least = std::min(least, static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
  }
  return least / measured;
}

/// Tells the cells of a chart or draft, and the time and bytes of its fabric, before the work: as measured on
/// charts of 8 to 576 stitches, and drafts of 1,024 and 10,000 crossings.
void report_estimate(const StitchSize& size, const MakeCommand& command) {
  constexpr int few = 8;
  if (size.crossing_count < few || command.common.json || command.common.quiet) return;
  const double cells = size.crossing_count;
  const double knit_seconds = 0.3 + 0.06 * std::sqrt(size.length_radii) + 0.00045 * size.length_radii;
  const double longer = (command.quality == "draft" ? 0.7 : 1) * (size.is_woven ? 2 : 1);
  const double seconds = relative_cpu_time() * longer * knit_seconds;
  const double root = std::sqrt(cells);
  const double kilobytes = size.is_woven ? 0.15 * cells + 4 * root : 0.6 * cells + 9 * root;
  report_remarks(
      command.common, command.input,
      {fmt::format("{} {}: about {:.0f} CPU seconds of this processor and {:.0f} KB", size.crossing_count,
                   size.is_woven ? "crossings" : "stitches", seconds, kilobytes)});
}

/// Loads the cell and bakes it, with progress.
Baked bake_cell(const MakeCommand& command) {
  const CommonOptions& common = command.common;
  BakeOptions options = command.options.bake;
  CellOptions cell_options = command.cell;
  cell_options.on_start = [&](const StitchSize& size) {
    if (options.stores_yarns || options.indirect == IndirectLight::lines)
      value_or_throw(check_room(size, command.input));
    if (size.is_sampler) {
      options.width = size.min_texels.x;
      options.height = size.min_texels.y;
      options.validation_pairs = options.held_out_pairs;
    } else {
      value_or_throw(set_texels(size.min_texels, size.repeats, command.has_texels, command.input,
                                command.options.bake, options));
    }
    if (!command.has_pair_rays) reduce_pair_samples(options);
    report_estimate(size, command);
  };
  if (options.indirect != IndirectLight::paths) cell_options.form = StitchForm::yarn;
  auto cell = [&] {
    TerminalProgress relaxation("relax", common.quiet);
    cell_options.progress = relaxation.callback();
    return value_or_throw(find_cell(command.input, cell_options));
  }();
  if (cell.stitch && !cell.stitch->arranged)
    value_or_throw(set_texels(cell.stitch->min_texels, cell.stitch->repeats, command.has_texels,
                              command.input, command.options.bake, options));
  // The hue of yarn that scatters inside comes from many bounces.
  if (!command.has_bounces && !cell.mesh.transmission.empty()) options.bounces = unlimited_bounces;
  TerminalProgress progress("bake", common.quiet);
  Json provenance = {{"software", "selvedge " SELVEDGE_VERSION},
                     {"stitch", std::filesystem::path(command.input).filename().string()}};
  if (!cell.yarn) {
    provenance["vertices"] = cell.mesh.positions.size();
    provenance["triangles"] = cell.mesh.triangles.size();
  }
  const YarnData& yarns = cell.yarn ? cell.yarn->yarns : cell.mesh.yarns;
  const V2d& period = cell.yarn ? cell.yarn->period : cell.mesh.period;
  if (cell.stitch && !yarns.curves.empty()) {
    const auto sheet = with_file_name(command.input, [&] { return sheet_of(*cell.stitch, yarns, period); });
    if (options.stores_yarns || sheet) provenance["sheet"] = value_or_throw(sheet);
  }
  if (cell.stitch) provenance["recipe"] = recipe_of(provenance["stitch"], *cell.stitch, command.recipe);
  const std::string text = provenance.dump(-1, ' ', false, Json::error_handler_t::replace);
  if (cell.stitch) cell.stitch->pattern = {};  // memory for its light
  auto baked = value_or_throw(cell.yarn ? bake(*cell.yarn, command.input, options, text, progress.callback())
                                        : bake(cell.mesh, command.input, options, text, progress.callback()));
  if (cell.stitch) {
    baked.report.steps_to_rest = cell.stitch->steps_to_rest;
    baked.report.rest_residual = cell.stitch->rest_residual;
  }
  // After the work, so that an error is a single line.
  report_remarks(common, command.input, cell.remarks);
  report_remarks(common, command.input, baked.report.remarks);
  return baked;
}

/// Fits samples, with progress; prints the remarks.
FitOutcome fit_samples(Samples samples, const MakeCommand& command) {
  TerminalProgress progress("fit", command.common.quiet);
  auto outcome = fit_fabric(std::move(samples), command.options, progress.callback());
  if (!outcome && outcome.error().file.empty()) outcome.error().file = command.input;
  FitOutcome fitted = value_or_throw(std::move(outcome));
  report_remarks(command.common, command.input, fitted.remarks);
  return fitted;
}

/// The fabric of --recolour in the colours of the stitch. Throws Failure.
MadeFabric recoloured(const MakeCommand& command) {
  const Stopwatch watch;
  const Fabric last = value_or_throw(read_fabric(command.recolour_path));
  CellOptions options = command.cell;
  const bool is_exact = command.recolouring == Recolouring::exact;
  options.form = is_exact ? StitchForm::yarn : StitchForm::pattern;
  if (options.kinds.by == KindLimit::By::size && last.find_map() == nullptr) options.kinds = {};
  TerminalProgress relaxation("relax", command.common.quiet);
  options.progress = relaxation.callback();
  Cell cell = value_or_throw(find_cell(command.input, options));
  const auto& yarns = last.levels.front().yarns();
  if (!is_exact && yarns && cell.stitch) {
    cell.yarn = {V2d(yarns->period()), yarns->data(), {}, static_cast<double>(last.thickness_mm)};
    if (!set_colours(cell.stitch->pattern, *cell.yarn)) cell.yarn.reset();
  }
  if (!cell.yarn || !differs_only_in_colour(last, *cell.yarn))
    throw Failure{{Code::option_out_of_range, command.recolour_path, "--recolour",
                   "has other yarn than " + command.input + ", where only colours may differ"}};
  MadeFabric made;
  Fabric& fabric = made.fit.fabric = recolour(last, *cell.yarn, command.recolouring);
  Json recipe = Json::parse(last.recipe);
  for (const char* name : {"set", "text"}) recipe.erase(name);
  recipe.update(
      recipe_of(std::filesystem::path(command.input).filename().string(), *cell.stitch, command.recipe));
  fabric.recipe = recipe.dump();
  made.fit.seconds = watch.seconds();
  report_remarks(command.common, command.input, cell.remarks);
  return made;
}

void declare_bake(Options& options, MakeCommand& command) {
  add_cell(options, command.input, command.cell);
  add_bake(options, command);
  add_quality(options, command);
  add_recipe(options, command);
  options.output(command.output, "The samples file").required();
}

Result<int> run_bake(const MakeCommand& command) {
  const Baked baked = bake_cell(command);
  value_or_throw(write_samples(command.output, baked.samples));
  const Json json = bake_json(baked.report, command.output);
  report(command.common, "bake", json, bake_text(json));
  return 0;
}

void declare_fit(Options& options, MakeCommand& command) {
  options.text("samples", command.input, "FILE", "The samples file").required().reads();
  add_fit(options, command);
  add_quality(options, command);
  add_recipe(options, command);
  options.output(command.output, "The fabric file").required();
}

constexpr const char* key_member = "run";

/// The digest of the run that made a fabric with --if-changed; empty without.
std::string key_of_fabric(const std::string& path) {
  const auto reader = FabricReader::open(path);
  if (!reader) return {};
  const Json provenance = Json::parse(reader->header().provenance, nullptr, false);
  return provenance.is_object() ? provenance.value(key_member, "") : "";
}

Result<int> run_fit(const MakeCommand& command) {
  FitOutcome fitted = fit_samples(value_or_throw(read_samples(command.input)), command);
  if (std::string& recipe = fitted.fabric.recipe; recipe != "{}") {
    Json whole = Json::parse(recipe);
    whole.update(command.recipe);
    recipe = whole.dump();
  }
  value_or_throw(write_fabric(command.output, fitted.fabric, command.options.write));
  const Json json = fit_json(fitted, command.output);
  report(command.common, "fit", json, fit_text(json));
  return 0;
}

Result<int> run_make(const MakeCommand& command) {
  if (!command.list_path.empty()) return make_from_list(command);
  const auto made = make_file(command);
  if (!made) {
    report(command.common, "make", {{"output", command.output}, {"kept", true}}, command.output + ": kept\n");
    return 0;
  }
  Json json{{"fit", fit_json(made->fit, command.output)}};
  if (command.recolour_path.empty()) json["bake"] = bake_json(made->bake, command.samples_path);
  report(command.common, "make", json,
         (json.contains("bake") ? bake_text(json["bake"]) : "") + fit_text(json["fit"]));
  return 0;
}

void declare_make(Options& options, MakeCommand& command) {
  add_cell(options, command.input, command.cell).required(false);
  add_bake(options, command);
  add_fit(options, command);
  add_quality(options, command);
  add_recipe(options, command);
  options.output(command.output, "The fabric file");
  options.text("--keep-samples", command.samples_path, "FILE", "Keep the samples in this file")
      .writes()
      .advanced();
  options
      .text(
          "--recolour", command.recolour_path, "FILE",
          "A fabric of this stitch in other colours: gives it the new ones; all else must be as it was made")
      .reads()
      .advanced();
  options.text("--kinds", "N|exact|none", "Make N stitches of a large repeat at most, and a map; none: all",
               [&command](const std::string& text) {
                 KindLimit& kinds = command.cell.kinds;
                 const auto count = parse_count(text, max_relaxed_stitches);
                 if (!count && text != "exact" && text != "none")
                   refuse("--kinds", fmt::format("\"{}\" is neither exact, none nor a count from 1 to {}",
                                                 text, max_relaxed_stitches));
                 kinds.stitches = count.value_or(0);
                 kinds.by = count             ? KindLimit::By::stitches
                            : text == "exact" ? KindLimit::By::exact
                                              : KindLimit::By::none;
               });
  options
      .number("--accuracy", command.cell.kinds.decibels, "DB",
              "Make as few stitches of a large repeat as keep this beside all kinds")
      .in_range(1, max_decibels);
  options.text("--list", command.list_path, "FILE", "Many fabrics, a line each: twill -o t.fabric.exr")
      .reads();
  options.number("--line", command.list_line, "N", "Make this line alone: a job of a job array")
      .in_range(1, 1e9)
      .advanced();
  command.key.declare(options);
  options.add_check([&options, &command] {
    // These need a fabric without a map, which has its yarn and one texel for each stitch.
    const std::vector<const char*> whole{"--texels", "--bytes", "--keep-samples"};
    const bool is_whole =
        !command.options.bake.stores_yarns || command.options.bake.indirect != IndirectLight::lines ||
        std::ranges::any_of(whole, [&](const char* name) { return options.is_given(name); });
    options.refuse_if(options.is_given("--accuracy"), "excludes --accuracy", {"--kinds"});
    if (options.is_given("--accuracy"))
      command.cell.kinds.by = KindLimit::By::accuracy;
    else if (!options.is_given("--kinds") && !is_whole)
      command.cell.kinds = {KindLimit::By::size, command.quality == "draft" ? 100 : 0};
    if (command.cell.kinds.by != KindLimit::By::none && is_whole)
      refuse(options.is_given("--accuracy") ? "--accuracy" : "--kinds",
             "needs yarn of standard or draft quality, without --texels, --bytes and --keep-samples");
    const bool many = !command.list_path.empty();
    if (many && options.is_given("input")) refuse("--list", "excludes a stitch");
    if (many)
      options.refuse_all_but({"--list", "--line", "--json", "--quiet", "--threads", "--if-changed"},
                             "has no effect with --list: write it into the list");
    options.refuse_if(!many, "needs --list", {"--line"});
    options.refuse_if(!command.recolour_path.empty(), "excludes --recolour", {"--keep-samples", "--bytes"});
    if (!many && !options.is_given("input")) refuse("input", "is required, or --list");
    if (!many && !options.is_given("--output")) refuse("--output", "is required");
  });
}

}  // namespace

Result<MakeCommand> make_command_of(const std::vector<std::string>& words, const std::string& file,
                                    const std::string& place) {
  MakeCommand command;
  const auto declare = [&command](Options& options) {
    options.common(command.common);
    declare_make(options, command);
  };
  if (const auto good = parse_words(declare, words, file, place); !good) return tl::unexpected(good.error());
  return command;
}

std::optional<MadeFabric> make_file(const MakeCommand& command) {
  const std::string key = command.key.digest(files_of_cell(command.input));
  const bool has_samples = command.samples_path.empty() || file_size_or_zero(command.samples_path) > 0;
  if (!key.empty() && has_samples && key_of_fabric(command.output) == key) return std::nullopt;
  value_or_throw(check_writable({command.output, command.samples_path}));
  MakeCommand needed = command;
  // Else no layers are chosen.
  if (!command.options.chooses_layers && !command.options.file_bytes && command.samples_path.empty())
    needed.options.bake.validation_pairs = 0;
  MadeFabric made;
  if (command.recolour_path.empty()) {
    Baked baked = bake_cell(needed);
    if (!command.samples_path.empty()) value_or_throw(write_samples(command.samples_path, baked.samples));
    made = {std::move(baked.report), fit_samples(std::move(baked.samples), command)};
  } else {
    made = recoloured(command);
  }
  if (!key.empty()) {
    Json provenance = Json::parse(made.fit.fabric.provenance);
    provenance[key_member] = key;
    made.fit.fabric.provenance = provenance.dump();
  }
  value_or_throw(write_fabric(command.output, made.fit.fabric, command.options.write));
  return made;
}

void add_bake_verb(Program& program) {
  program.add<MakeCommand>(
      {"bake", "Light a cell from all sides: stitch -> samples", "selvedge bake plain-knit -o k.samples.exr"},
      declare_bake, run_bake);
}

void add_fit_verb(Program& program) {
  program.add<MakeCommand>(
      {"fit", "Fit a fabric to samples: samples -> fabric", "selvedge fit k.samples.exr -o k.fabric.exr"},
      declare_fit, run_fit);
}

void add_make_verb(Program& program) {
  program.add<MakeCommand>({"make", "Stitch, bake and fit in one: stitch -> fabric",
                            "selvedge make plain-weave -o weave.fabric.exr"},
                           declare_make, run_make);
}

}  // namespace selvedge
