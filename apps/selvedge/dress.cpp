// dress: attaches a fabric to materials of a glTF garment.
#include "converter/dress/dress.h"

#include <algorithm>
#include <array>
#include <set>

#include "apps/common/run_key.h"
#include "apps/common/shared_options.h"
#include "apps/selvedge/commands.h"
#include "converter/dress/true_size.h"
#include "converter/stitch/parameters.h"
#include "format/base/printable.h"
#include "format/gltf/access.h"

namespace selvedge {
namespace {

V3f color_from(const std::string& option, const std::string& text) {
  const std::optional<V3d> color = linear_colour(text);
  if (!color) refuse(option, "must be of the form #rrggbb");
  return V3f(*color);
}

/// "NAME=#rrggbb" or "NAME=FABRIC".
Colourway colourway_of(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
    refuse("--variant", "must be of the form NAME=#rrggbb or NAME=FILE");
  Colourway colourway{escape_invalid_utf8(text.substr(0, equals))};  // JSON strings are UTF-8
  const std::string value = text.substr(equals + 1);
  if (value.starts_with('#'))
    colourway.color = color_from("--variant", value);
  else
    colourway.fabric = value;
  return colourway;
}

struct DressCommand {
  CommonOptions common;
  std::string garment;
  std::string fabric;
  std::string output;
  bool is_strict = false;
  RunKey key;
  DressOptions dress;
};

void declare(Options& options, DressCommand& command) {
  options.text("garment", command.garment, "FILE", "A glTF file (.gltf .glb), OBJ with its materials, or PLY")
      .required()
      .rewrites();
  options.text("fabric", command.fabric, "FILE", "The fabric file").required().reads();
  options
      .output(command.output, "The dressed garment: with the fabric (.glb), or beside it (.gltf)",
              {".gltf", ".glb"})
      .required();
  DressOptions& dress = command.dress;
  options.list("--material", dress.materials, "NAME", "Name of a material, or #index; may be repeated");
  options.flag("--all", dress.all_cloth,
               "Every material, but for buttons, zips, skin and the like by their names");
  options.list("--except", dress.excluded_materials, "NAME",
               "A material that stays as it is; may be repeated");
  options.text("--colour", "garment|fabric|#RRGGBB",
               "Colour of the cloth: the garment's own, print included [default], the yarn's, or this",
               [&dress](const std::string& text) {
                 dress.color_options.keeps_base_color = text == "garment";
                 if (text != "garment" && text != "fabric")
                   dress.color_options.color = color_from("--colour", text);
               });
  options.flag("--single-sided", dress.single_sided,
               "Leave single-sided materials so: one sees through their back");
  options.text("--backing", "#RRGGBB", "A plain surface of this colour behind the cloth, for solid things",
               [&dress](const std::string& text) { dress.backing = color_from("--backing", text); });
  options
      .list("--variant", "NAME=#RRGGBB|FILE",
            "A variant of the garment in this colour, or in another fabric; may be repeated",
            [&dress](const std::vector<std::string>& texts) {
              std::set<std::string> names;
              for (const std::string& text : texts) {
                dress.colourways.push_back(colourway_of(text));
                if (!names.insert(dress.colourways.back().name).second)
                  refuse("--variant", "gives two variants one name");
              }
            })
      .reads(true);
  options.vector("--repeats", dress.repeats, "U,V",
                 "Repeats per unit of the texture coordinates, instead of the physical size");
  options.number("--scale", dress.scale, "F", "Size of the stitches: 2 shows them twice as large");
  options.number("--rotate", dress.rotation_degrees, "DEG",
                 "Turn the cloth, counter-clockwise; by right angles unless its repeat is a square");
  options.vector("--offset", dress.offset, "U,V", "Move the cloth, in repeats");
  options.flag("--once", dress.lies_once,
               "Lay the middle of a repeat on the middle of the front: for a picture");
  static const auto units = [] {
    std::array<std::string_view, length_units.size()> names;
    std::ranges::transform(length_units, names.begin(), &LengthUnit::name);
    return names;
  }();
  const Option unit =
      options.choice("--unit", units, "Unit of the garment's lengths, where it is not metres",
                     [&dress](std::size_t i) { dress.metres_per_unit = length_units[i].metres; });
  options.number("--height", dress.garment_height, "METRES", "Height of the garment, instead of --unit")
      .excludes(unit);
  options.number("--texcoord", dress.tex_coord, "N", "Set of texture coordinates").in_range(0, 1);
  static constexpr std::array<std::string_view, 3> unwrappings{"auto", "always", "never"};
  options.choice("--unwrap", unwrappings, dress.unwrap,
                 "New texture coordinates, charts in true size, where the garment's are useless");
  options.set_flag("--no-fallback", dress.has_fallback, false, "Do not change the core material");
  options
      .text("--usda", dress.usd_path, "FILE",
            "Also this USD layer (.usda): the garment, its fallback, and the fabric's name")
      .ends_in({".usda"})
      .writes();
  command.key.declare(options);
  options.flag("--strict", command.is_strict,
               "Exit status 1 for a variant whose colour the fabric cannot reach");
  add_limits(options, dress.limits);
  options.add_check([&dress] {
    if (dress.materials.empty() && !dress.all_cloth) refuse("dress", "--material or --all is required");
  });
}

/// The digest of the run that dressed a garment with --if-changed; empty without.
std::string key_of_garment(const std::string& path) {
  const auto document = load_gltf(path);
  if (!document) return {};
  return string_of(member(member(member(document->json, "asset"), "extras"), run_key_member));
}

Result<int> run(const DressCommand& command) {
  DressOptions options = command.dress;
  options.run_key = command.key.digest();
  if (!options.run_key.empty() && key_of_garment(command.output) == options.run_key) {
    report(command.common, "dress", {{"output", command.output}, {"kept", true}},
           command.output + ": kept\n");
    return 0;
  }
  const auto dressed = value_or_throw(dress(command.garment, command.fabric, command.output, options));
  report_remarks(command.common, command.garment, dressed.warnings);
  Json issues = Json::array();
  for (const Error& issue : dressed.issues) {
    issues.push_back(to_json(issue));
    if (command.is_strict || !(command.common.quiet || command.common.json)) report_issue(issue);
  }
  Json materials = Json::array();
  Json unwrapped = Json::array();
  for (const DressedMaterial& m : dressed.materials) {
    materials.push_back({{"index", m.index},
                         {"name", m.name},
                         {"primitives", m.primitive_count},
                         {"repeats", m.repeats},
                         {"metresPerUv", m.uv_size.metres_per_uv},
                         {"metresPerUvLow", m.uv_size.metres_per_uv_p5},
                         {"metresPerUvHigh", m.uv_size.metres_per_uv_p95},
                         {"stretched", m.uv_size.stretched_fraction},
                         {"withoutUvs", m.uv_size.fraction_without_uvs},
                         {"kept", m.kept_members},
                         {"replaced", m.replaced_members}});
    if (const auto made = dressed.unwrap_reports.find(m.index); made != dressed.unwrap_reports.end())
      unwrapped.push_back(
          {{"index", m.index}, {"charts", made->second.chart_count}, {"stretch", m.uv_size.stretch_p95}});
  }
  Json variants = Json::array();
  for (const VariantMaterial& v : dressed.variants) {
    variants.push_back(
        {{"name", v.variant}, {"index", v.index}, {"of", v.base_material}, {"repeats", v.repeats}});
    if (v.tint) variants.back()["tint"] = *v.tint;
  }
  const Json json{
      {"output", command.output},     {"bytes", dressed.bytes},   {"bounds", dressed.bounds},
      {"embedded", dressed.embedded}, {"usd", dressed.usd_files}, {"backed", dressed.backed_primitive_count},
      {"materials", materials},       {"variants", variants},     {"unwrapped", unwrapped},
      {"warnings", dressed.warnings}, {"issues", issues}};
  report(command.common, "dress", json,
         lines_text(materials,
                    "#{index} {name}: {primitives} primitives, {repeats:.5g} repeats, {metresPerUv:.3g} m a "
                    "unit of uv (nine tenths of the area {metresPerUvLow:.3g} to {metresPerUvHigh:.3g}), "
                    "fraction stretched {stretched:.2f}, without uv {withoutUvs:.1g}; keeps {kept}; replaces "
                    "{replaced}") +
             lines_text(unwrapped,
                        "#{index} unwrapped into {charts} charts, 95 % of its area stretched less than "
                        "{stretch:.2f} times") +
             lines_text(variants,
                        "#{index} for #{of} in variant \"{name}\": {repeats:.5g} repeats, tint {tint:.3g}") +
             fill_pattern("fabric embedded {embedded}, backing behind {backed} primitives "
                          "-> {output} ({bytes} bytes), USD {usd}\n",
                          json));
  return command.is_strict && !dressed.issues.empty() ? 1 : 0;
}

}  // namespace

void add_dress_verb(Program& program) {
  program.add<DressCommand>({"dress", "Put a fabric on materials of a glTF garment",
                             "selvedge dress shirt.glb k.fabric.exr -o dressed.glb --material Cotton"},
                            declare, run);
}

}  // namespace selvedge
