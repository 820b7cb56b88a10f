// dress: attaches a fabric to materials of a glTF garment.
#include "converter/dress/dress.h"

#include <fmt/format.h>

#include "apps/common/shared_options.h"
#include "apps/selvedge/commands.h"

namespace selvedge {
namespace {

struct DressCommand {
  CommonOptions common;
  std::string garment;
  std::string fabric;
  std::string output;
  DressOptions dress;
};

void declare(Options& options, DressCommand& command) {
  options.common(command.common);
  options.text("garment", command.garment, "FILE", "A glTF file (.gltf .glb)").required();
  options.text("fabric", command.fabric, "FILE", "The fabric file").required();
  options.output(command.output, "The dressed garment (.gltf .glb)", ".glb", {".gltf", ".glb"}).required();
  DressOptions& dress = command.dress;
  options.list("--material", dress.materials, "NAME", "Name of a material, or #index; may be repeated");
  options.flag("--all", dress.all, "Every material");
  options.vector("--repeats", dress.repeats, "U,V",
                 "Repeats per unit of the texture coordinates, instead of the physical size");
  options.number("--texcoord", dress.tex_coord, "N", "Set of texture coordinates").in(0, 1);
  const Option embed =
      options.set_flag("--embed", dress.embed, true, "Embed the fabric in the glTF (default for .glb)");
  options
      .set_flag("--external", dress.embed, false, "Refer to the fabric beside the glTF (default for .gltf)")
      .excludes(embed);
  options.set_flag("--no-fallback", dress.fallback, false, "Do not change the core material");
  options
      .text("--usda", dress.usd, "FILE",
            "Also this USD layer (.usda): the garment, its fallback, and the fabric's name")
      .ends_in({".usda"});
  add_limits(options, dress.limits);
  options.check([&options, &dress] {
    if (dress.materials.empty() && !dress.all) refuse("dress", "--material or --all is required");
    options.refuse_if(options.piped_output() != nullptr, "has no place beside standard output",
                      {"--external"});
  });
}

Result<int> run(const DressCommand& command) {
  const auto dressed = must(dress(command.garment, command.fabric, command.output, command.dress));
  for (const std::string& warning : dressed.warnings) {
    if (!command.common.quiet) report_remark(command.garment, warning);
  }
  Json materials = Json::array();
  std::string text;
  for (const DressedMaterial& m : dressed.materials) {
    materials.push_back({{"index", m.index},
                         {"name", m.name},
                         {"primitives", m.primitives},
                         {"metresPerUv", {m.metres_per_uv.x, m.metres_per_uv.y}},
                         {"repeats", {m.repeats.x, m.repeats.y}},
                         {"spread", {m.spread.x, m.spread.y}}});
    text += fmt::format(
        "#{} {}: {} primitives, {:.4g} x {:.4g} m per unit of uv, {:.5g} x {:.5g} repeats, spread {:.1f} % x "
        "{:.1f} %\n",
        m.index, m.name, m.primitives, m.metres_per_uv.x, m.metres_per_uv.y, m.repeats.x, m.repeats.y,
        100 * m.spread.x, 100 * m.spread.y);
  }
  text += fmt::format("fabric {}, tangents added to {} primitives -> {} ({} bytes)\n",
                      dressed.embedded ? "embedded" : "beside", dressed.tangents_added, command.output,
                      dressed.bytes);
  for (const std::string& file : dressed.usd_files) text += fmt::format("USD: {}\n", file);
  report(command.common, "dress",
         {{"output", command.output},
          {"bytes", dressed.bytes},
          {"embedded", dressed.embedded},
          {"usd", dressed.usd_files},
          {"tangentsAdded", dressed.tangents_added},
          {"materials", materials},
          {"warnings", dressed.warnings}},
         text);
  return 0;
}

}  // namespace

void add_dress_verb(Program& program) {
  program.add<DressCommand>({"dress", "Put a fabric on materials of a glTF garment",
                             "selvedge dress shirt.glb k.fabric.exr -o dressed.glb --material Cotton"},
                            declare, run);
}

}  // namespace selvedge
