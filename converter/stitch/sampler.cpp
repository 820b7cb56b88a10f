#include "converter/stitch/sampler.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "converter/stitch/chart.h"
#include "converter/stitch/chart_stitches.h"
#include "converter/stitch/yarn_plies.h"
#include "format/base/guard.h"

namespace selvedge {

std::vector<std::vector<double>> part_begins_of(const StitchPattern& pattern,
                                                const std::vector<std::vector<KnitPart>>& parts) {
  std::vector<std::vector<double>> begins;
  for (std::size_t y = 0; y < parts.size(); ++y) {
    auto segment = pattern.yarns[y].segments.begin();
    double length = 0;
    std::vector<double>& own = begins.emplace_back();
    for (const KnitPart& part : parts[y]) {
      own.push_back(length);
      for (std::size_t k = 0; k < part.segments; ++k) length += polygon_length(*segment++);
    }
    for (double& begin : own) begin /= length;
  }
  return begins;
}

std::optional<Arrangement> arranged(const std::optional<StitchGrid>& grid, std::size_t stitches,
                                    const KindLimit& kinds, const StitchSettings& settings,
                                    const std::string& path) {
  const bool is_asked = kinds.by != KindLimit::By::size && kinds.by != KindLimit::By::none;
  const bool repeats = settings.contains("repeats");
  const auto refuse = [&](std::string why) {
    const char* const option = kinds.by == KindLimit::By::accuracy ? "--accuracy" : "--kinds";
    throw Failure{{Code::option_out_of_range, path, option, std::move(why)}};
  };
  if (is_asked && !grid) refuse("is for knit and purl stitches, and for evenly spaced yarns");
  if (is_asked && repeats) refuse("excludes repeats");
  std::optional<Arrangement> found;
  if (grid && !repeats) found = arrange(*grid, kinds);
  if (!found && kinds.by == KindLimit::By::stitches && stitches > static_cast<std::size_t>(kinds.stitches))
    refuse(fmt::format("{} stitches are too few for its yarns to run on", kinds.stitches));
  if (!found && stitches > max_relaxed_stitches)
    throw Failure{{Code::stitch_invalid, path, "",
                   fmt::format("{} stitches, of more than {} only knit and purl ones are made: {}", stitches,
                               max_relaxed_stitches, cut_to_repeat_advice)}};
  return found;
}

void fit_settings(const YarnMap& map, StitchSettings& settings) {
  settings.erase("float");
  const V2d part = V2d(map.kinds) / V2d(map.size);
  for (auto& [name, values] : settings)
    if (name == "width_mm" || name == "height_mm") values.front() *= name == "width_mm" ? part.x : part.y;
}

std::string remark_on(const Arrangement& arranged) {
  const auto& [eight, four, row] = arranged.stitches;
  return fmt::format(
      "{} x {} stitches are made, of {} x {} of {} kinds: {} are shown by 8 neighbours, {} by 4, {} by their "
      "row, {:.0f} dB beside all kinds{}",
      arranged.map.kinds.x, arranged.map.kinds.y, arranged.map.size.x, arranged.map.size.y,
      arranged.kind_count, eight, four, row, arranged.decibels,
      arranged.sampler.is_woven ? "" : "; floats are not caught");
}

void turn_by_stitch(const StitchGrid& sampler, StitchPattern& pattern) {
  std::size_t next = 0;
  const auto turn = [&](int loops, int floats) {
    Yarn& yarn = pattern.yarns[next++];
    if (yarn.plies == 1) return;
    const double length = frames_of(yarn, 0.5 * yarn.radius_mm).stations.back().arc_length;
    const double loop = (length - floats * pattern.period_mm.x / sampler.size.x) / loops;
    yarn.twist_per_mm = std::round(yarn.twist_per_mm * loop * yarn.plies) / (loop * yarn.plies);
  };
  for (int x = 0; x < sampler.size.x && sampler.is_woven; ++x) turn(sampler.size.y, 0);
  for (int y = 0; y < sampler.size.y; ++y) {
    const auto row = sampler.cells.begin() + std::ptrdiff_t{1} * y * sampler.size.x;
    if (sampler.is_woven) turn(sampler.size.x, 0);
    for (unsigned yarn = 0; yarn < max_chart_yarns && !sampler.is_woven; ++yarn)
      if (const auto loops = static_cast<int>(std::count_if(
              row, row + sampler.size.x, [&](int cell) { return sampler.stitches[cell].yarn == yarn; }));
          loops > 0)
        turn(loops, sampler.size.x - loops);
  }
}

}  // namespace selvedge
