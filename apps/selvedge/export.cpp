// export: writes the yarn of a dressed garment as geometry.
#include "converter/export/export.h"

#include "apps/common/shared_options.h"
#include "apps/selvedge/commands.h"

namespace selvedge {
namespace {

struct ExportCommand {
  CommonOptions common;
  std::string input;
  std::string output;
  ExportOptions exported;
};

void declare(Options& options, ExportCommand& command) {
  options.text("garment", command.input, "FILE", "A dressed garment (.gltf .glb)").required().reads();
  options
      .output(command.output, "The garment with its yarn as geometry (.gltf .glb .usda)",
              {".gltf", ".glb", ".usda"})
      .required();
  ExportOptions& exported = command.exported;
  options
      .number("--triangles", exported.triangle_budget, "N",
              "Triangles that are drawn at most; each copy counts")
      .in_range(1, 1e9);
  options.text("--region", "U0,V0,U1,V1", "The part in full detail, in repeats of the fabric",
               [&exported](const std::string& text) {
                 const auto n = parse_number_list("--region", text, ',', 4, 4, "100,120,130,150");
                 exported.region = Imath::Box2d(V2d(n[0], n[1]), V2d(n[2], n[3]));
                 if (exported.region->isEmpty()) refuse("--region", "its end lies before its begin");
               });
  add_limits(options, exported.limits);
}

Result<int> run(const ExportCommand& command) {
  const auto done = value_or_throw(export_yarn(command.input, command.output, command.exported));
  report_remarks(command.common, command.input, done.warnings);
  Json yarns = Json::array();
  for (const ExportedYarn& y : done.yarns) {
    yarns.push_back({{"material", y.material},
                     {"name", y.name},
                     {"triangles", y.triangles_per_copy},
                     {"copies", y.copy_count},
                     {"bent", y.bent_count},
                     {"cut", y.cut_count},
                     {"gap", y.max_gap_radii},
                     {"overlap", y.max_overlap_radii},
                     {"turn", y.max_turn_degrees},
                     {"shear", y.max_shear_degrees}});
  }
  const Json json{{"output", command.output},
                  {"bytes", done.bytes},
                  {"triangles", done.triangle_count},
                  {"yarns", yarns},
                  {"warnings", done.warnings}};
  report(
      command.common, "export", json,
      lines_text(yarns,
                 "#{material} {name}: {triangles} triangles a copy, {copies} copies, {bent} bent, {cut} "
                 "cut; gaps up to {gap:.2f} radii, overlaps {overlap:.2f}, turns {turn:.1f} degrees, shear "
                 "{shear:.1f}") +
          fill_pattern("{triangles} triangles -> {output} ({bytes} bytes)\n", json));
  return 0;
}

}  // namespace

void add_export_verb(Program& program) {
  program.add<ExportCommand>({"export", "Write the yarn of a dressed garment as geometry, for other viewers",
                              "selvedge export knitted.glb -o yarn.glb"},
                             declare, run);
}

}  // namespace selvedge
