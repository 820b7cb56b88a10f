#include "apps/selvedge/option_groups.h"

#include <fmt/format.h>

#include <array>

#include "converter/stitch/fibres.h"

namespace selvedge {
namespace {

/// Declares --set.
void add_settings(Options& options, CellOptions& cell) {
  options.list("--set", "NAME=VALUE",
               "A parameter of the stitch (selvedge stitch --list NAME); may be repeated",
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
  options
      .text("--float", "N", "Stitches that a yarn of a chart may pass before it is caught (pictures: 7)",
            [&cell](const std::string& text) {
              if (!parse_setting("float=" + text, cell.settings))
                refuse("--float", fmt::format("\"{}\" is no number", text));
            })
      .advanced();
}

}  // namespace

Option add_cell(Options& options, std::string& input, CellOptions& cell) {
  const Option option =
      options.text("input", input, "STITCH",
                   "A built-in stitch (selvedge stitch --list), a stitch description (.json), a "
                   "weaving draft (.wif), a knitting chart or instructions (.txt, or .png, a pixel a "
                   "stitch), or a mesh (.obj .ply)");
  option.required().reads();
  add_settings(options, cell);
  MeshImportOptions& import = cell.import;
  options.text("--period", "WxH",
               "Size of one repeat, mm, such as 5x4: knits are blocked to it; of meshes (guessed)",
               [&import](const std::string& t) {
                 const auto n = parse_number_list("--period", t, 'x', 2, 2, "5x4");
                 import.period = V2d(n[0], n[1]);
               });
  options.begin_group("Meshes from files");
  options.number("--unit", import.scale_to_mm, "MM", "Millimetres per unit of the file (guessed)").advanced();
  static constexpr std::array<std::string_view, 3> axes{"x", "y", "z"};
  options
      .choice("--up", axes, "The file's axis out of the cloth (guessed)",
              [&import](std::size_t axis) {
                import.up_axis = std::array{UpAxis::x, UpAxis::y, UpAxis::z}[axis];
              })
      .advanced();
  options.vector("--albedo", import.albedo, "R,G,B", "Linear, where the file has no colours (0.5,0.5,0.5)")
      .advanced();
  options.begin_group("");
  return option;
}

void add_bounces(Options& options, int& bounces) {
  options.text("--bounces", "N|unlimited",
               fmt::format("Bounces of light along paths [{}]",
                           bounces == unlimited_bounces ? "unlimited" : std::to_string(bounces)),
               [&bounces](const std::string& t) {
                 bounces = t == "unlimited"
                               ? unlimited_bounces
                               : parse_integer_list("--bounces", t, ',', 1, 1, "2 or unlimited")[0];
                 if (t != "unlimited" && bounces < 0) refuse("--bounces", "must not be negative");
               });
}

}  // namespace selvedge
