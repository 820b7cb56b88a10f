#include <fmt/format.h>

#include <cmath>

#include "apps/selvedge/commands.h"
#include "apps/selvedge/make.h"
#include "apps/selvedge/option_groups.h"
#include "converter/stitch/clearance.h"
#include "converter/stitch/fibres.h"
#include "converter/stitch/find_cell.h"
#include "converter/stitch/library.h"
#include "converter/stitch/pattern_json.h"
#include "converter/stitch/text_cells.h"
#include "converter/stitch/text_fault.h"
#include "converter/stitch/textile.h"
#include "converter/stitch/yarn_mesh.h"
#include "format/base/atomic_file.h"
#include "format/base/option_text.h"

namespace selvedge {
namespace {

struct StitchCommand {
  CommonOptions common;
  bool list = false;
  std::string input;   ///< built-in name, stitch description, draft, chart or mesh file
  std::string output;  ///< .obj, .ply or .json; empty: report only
  CellOptions cell;
};

void declare(Options& options, StitchCommand& command) {
  add_cell(options, command.input, command.cell).required(false);
  options.flag("--list", command.list,
               "The built-in stitches, or the parameters of one or of a text, with its cells as JSON");
  options.output(command.output, "The cell's mesh (.obj .ply), or the stitch description (.json)",
                 {".obj", ".ply", ".json"});
  options.add_check([&command] {
    if (command.input.empty() && !command.list) refuse("stitch", "a stitch or --list is required");
  });
}

/// "1.5" or "0.5,0.4,0.3", the form of --set.
std::string text_of(const std::vector<double>& value) {
  std::string text;
  for (const double number : value) text += fmt::format("{}{:g}", text.empty() ? "" : ",", number);
  return text;
}

Result<int> list_parameters(const StitchCommand& command, const StitchInfo& info) {
  std::string text = fmt::format("{}: {}\n", info.name, info.description);
  for (const StitchParameter& p : info.parameters) {
    if (p.name.ends_with(yarn_parameter)) {
      text += fmt::format("  {:20} {:>16}  {}\n", p.name,
                          yarn_kinds()[static_cast<std::size_t>(p.default_value.front())].name, p.meaning);
      continue;
    }
    text += fmt::format("  {:20} {:>16}  {} ({:g} to {:g})\n", p.name, text_of(p.default_value), p.meaning,
                        p.min, p.max);
  }
  report(command.common, "stitch", to_json(info), text);
  return 0;
}

Result<int> list_stitches(const StitchCommand& command) {
  Json list = Json::array();
  std::string text;
  for (const StitchInfo& info : built_in_stitches()) {
    if (info.name == command.input) return list_parameters(command, info);
    list.push_back({{"name", info.name}, {"description", info.description}, {"cover", info.cover_fraction}});
    text += fmt::format("{:14} cover {:.3f}  {}\n", info.name, info.cover_fraction, info.description);
  }
  if (command.input.empty()) {
    report(command.common, "stitch", {{"stitches", list}}, text);
    return 0;
  }
  // The parameters and cells of a text; with --json the cells of one that is refused, too.
  const auto info = describe_stitch(command.input);
  const Json cells = chart_or_draft_json(command.input);
  if (!info && (cells.is_null() || !command.common.json)) throw Failure{info.error()};
  if (info && !command.common.json) return list_parameters(command, *info);
  Json json = info ? to_json(*info) : Json{{"stitch", command.input}, {"error", to_json(info.error())}};
  if (!cells.is_null()) json["cells"] = cells;
  report(command.common, "stitch", json, "");
  return info ? 0 : 1;
}

/// Adds how a knit came to rest.
std::string rest_text(const FoundStitch& stitch, Json& json) {
  if (stitch.steps_to_rest == 0) return "";
  json["rest"] = {{"steps", stitch.steps_to_rest}, {"residual", stitch.rest_residual}};
  return fill_pattern(", at rest after {steps} steps, residual {residual:.1g}", json["rest"]);
}

/// The stitch of the input in this form, with progress. Throws Failure.
Cell cell_of(const StitchCommand& command, StitchForm form) {
  TerminalProgress relaxation("relax", command.common.quiet);
  CellOptions options = command.cell;
  options.progress = relaxation.callback();
  options.form = form;
  return value_or_throw(find_cell(command.input, options));
}

Result<int> write_description(const StitchCommand& command) {
  if (!is_stitch(command.input)) value_or_throw(find_stitch(command.input));
  const FoundStitch stitch = cell_of(command, StitchForm::pattern).stitch.value();
  value_or_throw(write_file(command.output, to_json(stitch.pattern)));
  Json json{{"stitch", stitch.pattern.name},
            {"output", command.output},
            {"yarns", stitch.pattern.yarns.size()},
            {"thicknessFraction", stitch.thickness_fraction},
            {"remarks", stitch.remarks}};
  const std::string rest = rest_text(stitch, json);
  report(command.common, "stitch", json,
         fill_pattern("{stitch}: {yarns} yarns", json) + rest + " -> " + command.output + "\n" +
             lines_text(json["remarks"], "  {}"));
  return 0;
}

Result<int> run(const StitchCommand& command) {
  if (command.list) return list_stitches(command);
  if (has_ending(command.output, ".json")) return write_description(command);
  const Cell cell = cell_of(command, StitchForm::surface);
  const CellMesh& mesh = cell.mesh;
  Json json = {{"stitch", command.input},
               {"vertices", mesh.positions.size()},
               {"triangles", mesh.triangles.size()},
               {"periodMm", mesh.period},
               {"heightMm", bounds_of(mesh).size().z}};
  std::string text = fill_pattern(
      "{stitch}: {vertices} vertices, {triangles} triangles, {periodMm:.5g} mm, {heightMm:.3g} mm high",
      json);
  if (cell.stitch && hides_plies(cell.stitch->pattern)) {
    text += rest_text(*cell.stitch, json);  // numbers of so much yarn would take longer than its rest
  } else if (cell.stitch) {
    const auto clearance = value_or_throw(minimum_clearance(cell.stitch->pattern, command.input));
    json["yarns"] = cell.stitch->pattern.yarns.size();
    json["clearanceMm"] = clearance;
    json["thicknessFraction"] = cell.stitch->thickness_fraction;
    text += std::abs(clearance) < 1e-6
                ? ", yarns touch"
                : fmt::format(", yarns {} {:.2g} mm", clearance < 0 ? "overlap by" : "are apart by",
                              std::abs(clearance));
    const auto numbers = value_or_throw(with_file_name(
        command.input, [&] { return textile_numbers(cell.stitch->pattern, cell.stitch->stitch_count); }));
    json["tex"] = numbers.tex;
    json["tightness"] = numbers.tightness;
    json["gramsPerM2"] = numbers.weight_g_per_m2;
    json["thicknessMm"] = numbers.thickness_mm;
    json["cover"] = numbers.cover_fraction;
    json["coverWithHairs"] = numbers.cover_fraction_with_hairs;
    text += fmt::format(", {:.0f} g/m2, {:.1f} mm thick, {:.0f} tex, cover {:.3f} ({:.3f} with hairs)",
                        numbers.weight_g_per_m2, numbers.thickness_mm, numbers.tex.front(),
                        numbers.cover_fraction, numbers.cover_fraction_with_hairs);
    text += rest_text(*cell.stitch, json);
    if (numbers.tightness > 0) text += fmt::format(", tightness {:.1f}", numbers.tightness);
  } else {
    const MeshChoices& c = *cell.choices;
    json["guessed"] = {{"period", c.period_source}, {"unit", c.scale_source}, {"up", c.up_axis_source}};
    json["unitMm"] = c.scale_to_mm;
    json["up"] = name_of(c.up_axis);
  }
  if (!command.output.empty()) value_or_throw(write_mesh(command.output, mesh));
  json["remarks"] = cell.remarks;
  json["output"] = command.output;
  text += (command.output.empty() ? "" : " -> " + command.output) + "\n";
  report(command.common, "stitch", json, text + lines_text(json["remarks"], "  {}"));
  return 0;
}

}  // namespace

Json stitches_for_pages() {
  Json known = {{"kinds", Json::array()}, {"stitches", Json::array()}, {"options", recipe_option_names}};
  for (const StitchInfo& info : built_in_stitches()) known["stitches"].push_back(to_json(info));
  for (const YarnKind& kind : yarn_kinds()) known["kinds"].push_back(kind.name);
  return known;
}

void add_stitch_verb(Program& program) {
  program.add<StitchCommand>({"stitch", "Mesh one cell of a stitch, or write its description",
                              "selvedge stitch plain-knit -o plain-knit.ply"},
                             declare, run);
}

}  // namespace selvedge
