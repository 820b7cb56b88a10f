// reattach: restores fabrics that an optimiser has dropped from a garment.
#include "converter/dress/reattach.h"

#include "apps/common/shared_options.h"
#include "apps/selvedge/commands.h"

namespace selvedge {
namespace {

struct ReattachCommand {
  CommonOptions common;
  std::string input;
  std::string output;
  ReattachOptions reattach;
};

void declare(Options& options, ReattachCommand& command) {
  options.common(command.common);
  options.text("garment", command.input, "FILE", "A glTF file (.gltf .glb) whose materials kept their extras")
      .required()
      .rewrites();
  options.output(command.output, "The garment with its fabrics (.gltf .glb)", {".gltf", ".glb"}).required();
  ReattachOptions& reattach = command.reattach;
  options
      .list("--fabric", reattach.fabrics, "[NAME=]FILE",
            "A fabric file that is missing, such as one that was embedded; may be repeated")
      .reads(true);
  add_limits(options, reattach.limits);
}

Result<int> run(const ReattachCommand& command) {
  const auto restored = value_or_throw(reattach(command.input, command.output, command.reattach));
  report_remarks(command.common, command.input, restored.warnings);
  Json materials = Json::array();
  for (const ReattachedMaterial& m : restored.materials) {
    const UvTransform& t = m.transform;
    materials.push_back({{"index", m.index},
                         {"name", m.name},
                         {"fabric", m.fabric},
                         {"texCoord", m.tex_coord},
                         {"offset", t.offset},
                         {"rotation", t.rotation},
                         {"scale", t.scale}});
  }
  const Json json{{"output", command.output},      {"bytes", restored.bytes},
                  {"embedded", restored.embedded}, {"materials", materials},
                  {"attached", restored.attached}, {"warnings", restored.warnings}};
  report(
      command.common, "reattach", json,
      lines_text(materials, "#{index} {name}: {fabric}, {scale:.5g} repeats per unit of uv") +
          filled("{embedded} fabrics embedded -> {output} ({bytes} bytes); materials that had one already: "
                 "{attached}\n",
                 json));
  return 0;
}

}  // namespace

void add_reattach_verb(Program& program) {
  program.add<ReattachCommand>({"reattach", "Restore the fabrics that an optimiser has dropped",
                                "selvedge reattach packed.glb -o restored.glb --fabric k.fabric.exr"},
                               declare, run);
}

}  // namespace selvedge
