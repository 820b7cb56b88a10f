#include "apps/selvedge/option_groups.h"

#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>

#include "converter/stitch/fibres.h"

namespace selvedge {

void add_settings(Options& options, CellOptions& cell) {
  options.list("--set", "NAME=VALUE",
               "Set a parameter of the stitch (selvedge stitch --list NAME); may be repeated",
               [&cell](const std::vector<std::string>& given) {
                 for (const std::string& text : given) {
                   const std::size_t before = cell.settings.size();
                   if (!parse_setting(text, cell.settings))
                     refuse("--set", fmt::format("\"{}\" is not of the form name=1.5, colour=#aa3322 or "
                                                 "yarn=wool (there are {})",
                                                 text, yarn_kind_names()));
                   if (cell.settings.size() == before)
                     refuse("--set", fmt::format("\"{}\" sets a parameter a second time", text));
                 }
               });
}

Option add_cell(Options& options, std::string& input, CellOptions& cell) {
  const Option option =
      options.text("input", input, "STITCH",
                   "A built-in stitch (selvedge stitch --list), a stitch description (.json), a "
                   "weaving draft (.wif), a knitting chart (.txt), or a mesh (.obj .ply)");
  option.required().reads();
  options.number("--grid", cell.mesh.cells_across, "N",
                 "Stitches: marching cubes along the longer period (0: as the yarns need)");
  add_settings(options, cell);
  options.group("Meshes from files");
  MeshImportOptions& import = cell.import;
  options.text("--period", "WxH", "Size of one repeat, mm, such as 5x4 (guessed)",
               [&import](const std::string& t) {
                 const auto n = numbers_from("--period", t, 'x', 2, 2, "5x4");
                 import.period = V2d(n[0], n[1]);
               });
  options.number("--unit", import.scale_to_mm, "MM", "Millimetres per unit of the file (guessed)");
  static constexpr std::array<std::string_view, 3> axes{"x", "y", "z"};
  options.choice("--up", axes, "The file's axis out of the cloth (guessed)", [&import](std::size_t axis) {
    import.up_axis = std::array{UpAxis::x, UpAxis::y, UpAxis::z}[axis];
  });
  options.vector("--albedo", import.albedo, "R,G,B", "Linear, where the file has no colours (0.5,0.5,0.5)");
  options.group("");
  return option;
}

BakeShard shard_from(const std::string& option, const std::string& text) {
  const auto n = whole_numbers_from(option, text, '/', 2, 2, "0/8");
  if (n[0] < 0 || n[0] >= n[1]) refuse(option, fmt::format("\"{}\" is not one of its parts", text));
  return {n[0], n[1]};
}

void add_transport(Options& options, const TransportOptions& transport) {
  int& bounces = transport.bounces;
  options.text("--bounces", "N|unlimited",
               fmt::format("Indirect bounces of light [{}]",
                           bounces == unlimited_bounces ? "unlimited" : std::to_string(bounces)),
               [&bounces](const std::string& t) {
                 bounces = t == "unlimited"
                               ? unlimited_bounces
                               : whole_numbers_from("--bounces", t, ',', 1, 1, "2 or unlimited")[0];
                 if (t != "unlimited" && bounces < 0) refuse("--bounces", "must not be negative");
               });
  static constexpr std::array<std::string_view, 2> kinds{"cached", "traced"};
  options.choice("--indirect", kinds, transport.indirect,
                 fmt::format("Indirect light once per point of the mesh, or along paths: slower, without "
                             "approximation [{}]",
                             name_of(transport.indirect)));
  options.number("--ground", transport.ground, "ALBEDO",
                 "Albedo of a plane that the cloth lies on (default: black)");
  ReferencePlane& reference = transport.reference;
  options.text("--reference-height", "top|P%|MM",
               "Height of the texels' plane above the cell's lowest point [90% of the thickness]",
               [&reference](const std::string& t) {
                 using Kind = ReferencePlane::Kind;
                 if (t == "top") {
                   reference = {Kind::top, 0};
                   return;
                 }
                 const bool percent = t.ends_with('%');
                 const double value =
                     numbers_from("--reference-height", t.substr(0, t.size() - (percent ? 1 : 0)), ',', 1, 1,
                                  "top, 90% or 2.5")[0];
                 reference = {percent ? Kind::share : Kind::at, percent ? value / 100 : value};
               });
}

void add_bake(Options& options, BakeOptions& bake) {
  options.group("Bake");
  const std::string texels = fmt::format("Texels of one repeat [{}x{}]", bake.width, bake.height);
  options.text("--texels", "N|WxH", texels, [&bake](const std::string& t) {
    const auto n = whole_numbers_from("--texels", t, 'x', 1, 2, "32 or 32x16");
    bake.width = n.front();
    bake.height = n.back();
  });
  options.number("--views", bake.views, "N", "View directions");
  options.number("--lights", bake.lights, "N", "Light directions");
  options.number("--samples", bake.samples, "N", "Rays per texel and view");
  add_transport(options, {bake.bounces, bake.indirect, bake.ground, bake.reference});
  options.number("--validation-pairs", bake.validation_pairs, "N", "Random pairs of directions to choose by");
  options.number("--held-out-pairs", bake.held_out_pairs, "N", "Random pairs to measure errors by");
  options.number("--rim-pairs", bake.rim_pairs, "N", "Random pairs near the horizon, measured separately");
  static constexpr std::array<std::string_view, 2> on_off{"on", "off"};
  static constexpr std::array<std::string_view, 2> sides{"front", "both"};
  options.choice(
      "--sides", sides,
      "Views and lights of the front alone, or of both sides: cloth that lets light through [front]",
      [&bake](std::size_t index) { bake.both_sides = index == 1; });
  options.choice("--yarns", on_off, "Store the yarn itself: sharp close by",
                 [&bake](std::size_t index) { bake.yarns = index == 0; });
  options.number("--truth-samples", bake.truth_samples, "N", "Rays per texel and pair, rounded down to even");
  options.number("--seed", bake.seed, "N", "Same seed, same bytes");
}

void add_fit(Options& options, MakeOptions& make) {
  FitOptions& fit = make.fit;
  options.group("Fit");
  options.number("--lobes", fit.lobes, "N", "Lafortune lobes per texel").in(0, 16);
  options.set_flag("--no-table", fit.view_table, false, "Leave the view table out");
  options.number("--starts", fit.starts, "N", "Local minima to compare per texel and channel").in(1, 1000);
  options.number("--iterations", fit.max_iterations, "N", "Maximum number of steps of a search")
      .in(1, 100000);
  options
      .number("--tolerance", fit.tolerance, "X",
              "A search ends when a step lowers the cost by less than this share")
      .in(0, 1e300);
  options.number("--damping", fit.table.damping, "X", "Pull of the table towards 1 where the lobes are dark")
      .in(0, 1e300);
  options
      .number("--smoothness", fit.table.smoothness, "X",
              "Pull of the table's neighbouring views towards each other")
      .in(0, 1e300);
  options.bytes("--budget", make.budget,
                "Choose the layers of every level so that the file without its yarn has at most this many "
                "bytes (K, M: KiB, MiB)");
  options.flag(
      "--half-lobes", [&make] { make.write.half.insert(LayerKind::lobes); },
      "Lobes in 16 instead of 32 bits");
  options.flag(
      "--float-tables", [&make] { make.write.half.erase(table_layers); },
      "Tables and frames in 32 instead of 16 bits");
}

void add_quality(Options& options, std::string& quality) {
  options.group("Speed against accuracy");
  static constexpr std::array<std::string_view, 5> names{"draft", "standard", "high", "reference", "paper"};
  options.choice(
      "--quality", names,
      "Settings that are worth their cost, or those of the paper; options given beside it stay as given. "
      "Its budget grows with the texels [standard]",
      [&quality](std::size_t index) { quality = names[index]; });
}

void apply_quality(const Options& options, const std::string& quality, MakeOptions& make) {
  const MakeOptions preset = *preset_named(quality);
  nlohmann::json knobs = knobs_of(preset);
  // Of the three verbs each has options that others lack.
  const auto given = [&](const char* name) { return options.declared(name) && options.given(name); };
  for (const char* knob : {"texels", "views", "lights", "samples", "bounces", "lobes", "budget", "yarns"}) {
    if (given((std::string("--") + knob).c_str())) knobs.erase(knob);
  }
  // Layers go together: who asks for some by name has chosen them.
  if (given("--no-table")) {
    knobs.erase("layers");
    knobs.erase("budget");
  }
  if (given("--budget") && !preset.budget) knobs.erase("layers");
  if (given("--half-lobes") || given("--float-tables")) knobs.erase("storage");
  if (!given("--budget")) make.budget.reset();
  (void)set_knobs(knobs, "", "", make);
  // Yarns that need more texels have as many bytes for each.
  make.budget_texels = knobs.contains("budget") ? preset.budget_texels : 0;
}

}  // namespace selvedge
