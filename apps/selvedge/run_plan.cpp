// plan: what a scene requires of its fabrics.
#include <fmt/format.h>

#include <cmath>

#include "apps/common/distinct_paths.h"
#include "apps/selvedge/commands.h"
#include "apps/selvedge/report.h"
#include "converter/plan/plan_file.h"
#include "format/base/atomic_file.h"

namespace selvedge {
namespace {

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

}  // namespace

int run(const PlanCommand& command) {
  apply(command.common);
  const auto distinct = check_distinct({{"the scene", command.scene}, {"--output", command.output}});
  if (!distinct) return report_error(distinct.error());
  std::optional<AtomicFile> file;
  if (!command.output.empty()) {
    auto created = AtomicFile::create(command.output);
    if (!created) return report_error(created.error());
    file.emplace(std::move(*created));
  }
  const auto plan = plan_scene(command.scene, command.plan);
  if (!plan) return report_error(plan.error());
  const Json json = plan_json(*plan);
  if (file) {
    if (auto good = write_file(file->temporary(), wrapped("plan", json)); !good)
      return report_error(good.error());
    if (auto good = file->commit(); !good) return report_error(good.error());
  }
  std::string text;
  for (const MaterialPlan& material : plan->materials) text += text_of(material);
  report(command.common, "plan", json, text);
  return 0;
}

}  // namespace selvedge
