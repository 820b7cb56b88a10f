// plan: the mip levels that a scene needs.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <climits>
#include <cmath>

#include "apps/common/paths.h"
#include "apps/common/shared_options.h"
#include "apps/selvedge/commands.h"
#include "converter/plan/plan_file.h"
#include "format/base/atomic_file.h"

namespace selvedge {
namespace {

struct PlanCommand {
  CommonOptions common;
  std::string scene;
  std::string output;  ///< .json; empty: report only
  PlanOptions plan;
};

void declare(Options& options, PlanCommand& command) {
  PlanOptions& plan = command.plan;
  options.common(command.common);
  options.text("scene", command.scene, "FILE", "A dressed glTF file (.gltf .glb)").required().reads();
  options.output(command.output, "The plan (.json), for selvedge make --for", {".json"});
  options.size("--size", plan.size, "Size of the frame in pixels", INT_MIN, INT_MAX);
  options.number("--supersample", plan.supersample, "N", "Draw N times larger per side");
  add_scene_choice(options, plan.choice);
  add_limits(options, plan.limits);
  options.group("Camera, as of selvedge-view render");
  options.list("--camera", plan.cameras, "NAME|N",
               "A camera of the file, by name or number; may be repeated");
  options
      .list(
          "--distance", "NEAR FAR",
          "Two: seen from anywhere around, at least and at most so many metres from the scene's middle; one: "
          "of a single camera",
          [&plan](const std::vector<std::string>& texts) {
            const auto n =
                numbers_from("--distance", fmt::format("{}", fmt::join(texts, ",")), ',', 1, 2, "2 5");
            if (n.size() == 1) plan.camera.distance = n[0];
            if (n.size() == 2) plan.distances = V2d(n[0], n[1]);
          })
      .count(1, 2);
  add_camera(options, plan.camera);
  options.check([&options, &plan] {
    const bool of_file = !plan.cameras.empty();
    const bool all_around = plan.distances.has_value();
    const bool has_distance = options.given("--distance");
    options.refuse_if(all_around, "has no meaning with --distance NEAR FAR, which looks from everywhere",
                      {"--azimuth", "--elevation", "--distance-factor", "--look-at"});
    options.refuse_if(of_file, "has no meaning with --camera",
                      {"--azimuth", "--elevation", "--distance-factor", "--look-at"});
    options.refuse_if(of_file && !all_around, "has no meaning with --camera",
                      {"--fov", "--orthographic", "--distance"});
    options.refuse_if(options.given("--orthographic") && !has_distance,
                      "has no meaning with --orthographic, without --distance", {"--fov"});
    options.refuse_if(has_distance, "has no meaning with --distance", {"--distance-factor"});
  });
}

std::string text_of(const MaterialPlan& m) {
  std::string text = fmt::format("#{} {} ({}): ", m.index, m.name, m.fabric);
  if (!m.seen) return text + "is not seen\n";
  text += fmt::format("levels {} to {} of 0 to {}, ", m.levels.first, m.levels.last, m.whole_levels - 1);
  const double texel_mm = m.demand.min_mm * std::exp2(m.demand.bias);
  text +=
      texel_mm > 0 ? fmt::format("texels of {:.3g} mm", texel_mm) : std::string("texels as fine as can be");
  text += m.backs ? (m.fronts ? ", both sides" : ", backs alone") : ", fronts alone";
  text += m.holes ? ", holes" : ", no holes";
  if (m.lacking.finer > 0) text += fmt::format("; the {} finest are not in the file", m.lacking.finer);
  if (m.lacking.coarser > 0) text += fmt::format("; the {} coarsest are not in the file", m.lacking.coarser);
  return text + "\n";
}

Result<int> run(const PlanCommand& command) {
  must(check_writable({command.output}));
  const auto plan = must(plan_scene(command.scene, command.plan));
  const Json json = plan_json(plan);
  if (!command.output.empty()) {
    must(write_file(command.output, report_text(framed("plan", json))));
  }
  std::string text;
  for (const MaterialPlan& material : plan.materials) text += text_of(material);
  report(command.common, "plan", json, text);
  return 0;
}

}  // namespace

void add_plan_verb(Program& program) {
  program.add<PlanCommand>(
      {"plan", "What a scene requires of its fabrics: levels, size of texels, backs, holes",
       "selvedge plan dressed.glb --distance 2 5 --fov 45 --size 1920x1080 -o plan.json"},
      declare, run);
}

}  // namespace selvedge
