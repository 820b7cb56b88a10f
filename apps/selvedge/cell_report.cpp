#include "apps/selvedge/cell_report.h"

#include <fmt/format.h>

namespace selvedge {

std::vector<std::string> remarks_of(const Cell& cell) {
  if (cell.stitch) return cell.stitch->remarks;
  const MeshChoices& c = *cell.choices;
  std::vector<std::string> remarks;
  const auto add = [&](const std::string& remark, const std::string& from) {
    if (from != "given") remarks.push_back(fmt::format("{} ({})", remark, from));
  };
  add(fmt::format("period {:g} x {:g} mm", c.period.x, c.period.y), c.period_from);
  add(fmt::format("{:g} mm per unit", c.scale_to_mm), c.scale_from);
  add(fmt::format("axis {} out of the cloth", name_of(c.up_axis)), c.up_axis_from);
  return remarks;
}

void report_remarks(const CommonOptions& common, const std::string& input, const Cell& cell,
                    const std::vector<std::string>& others) {
  if (common.json || common.quiet) return;
  for (const std::string& remark : remarks_of(cell)) report_remark(input, remark);
  for (const std::string& remark : others) report_remark(input, remark);
}

}  // namespace selvedge
