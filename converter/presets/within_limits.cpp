#include "converter/presets/within_limits.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace selvedge {
namespace {

/// Rank of a setting, compared lexicographically, less is better: octaves of cost too many, decibels missing,
/// then the preference among settings that are equally near to the limits.
std::array<double, 4> rank_of(const MakeLimits& limits, const MakeFigures& f) {
  double octaves = 0;
  if (limits.bytes) octaves = std::log2(f.bytes / static_cast<double>(*limits.bytes));
  if (limits.seconds) octaves = std::max(octaves, std::log2(f.seconds / *limits.seconds));
  octaves = std::max(octaves, 0.0);
  if (!limits.held_out) return {octaves, 0, -f.held_out, f.seconds};
  return {octaves, std::max(0.0, *limits.held_out - f.held_out), f.seconds, f.bytes};
}

/// A row of the table as it is made within the limits.
TriedSetting setting_of(const MeasuredSetting& row, const MakeLimits& limits, const MakeOptions& base) {
  TriedSetting setting{with_knobs(row.knobs, base), {row.bytes, row.seconds, row.held_out}, {}};
  if (auto& budget = setting.options.budget; budget && limits.bytes) {
    setting.options.budget_has_yarn = true;
    const bool enough = limits.held_out && row.held_out >= *limits.held_out;
    budget = enough ? std::min(*budget, *limits.bytes) : *limits.bytes;
  }
  return setting;
}

}  // namespace

bool meets(const MakeLimits& limits, const MakeFigures& f) {
  return (!limits.bytes || f.bytes <= static_cast<double>(*limits.bytes)) &&
         (!limits.held_out || f.held_out >= *limits.held_out) &&
         (!limits.seconds || f.seconds <= *limits.seconds);
}

Result<WithinLimits> make_within(std::span<const MeasuredSetting> table, const MakeLimits& limits,
                                 const MakeOptions& base, int min_texels, int threads,
                                 const std::function<Result<MakeFigures>(const MakeOptions&)>& make) {
  std::vector<MeasuredSetting> rows(table.begin(), table.end());
  for (MeasuredSetting& row : rows) row.seconds /= threads;
  WithinLimits result;
  for (int turn = 0; turn < 2; ++turn) {
    std::optional<TriedSetting> best;
    for (const MeasuredSetting& row : rows) {
      TriedSetting setting = setting_of(row, limits, base);
      if (setting.options.bake.width < min_texels) continue;
      if (turn > 0 && settings_name(setting.options) == settings_name(result.tried.front().options)) continue;
      if (!best || rank_of(limits, setting.expected) < rank_of(limits, best->expected)) best = setting;
    }
    if (!best) break;
    const auto made = make(best->options);
    if (!made) return tl::unexpected(made.error());
    best->made = *made;
    // How this stitch and this machine differ from the means of the table.
    const MakeFigures& expected = best->expected;
    for (MeasuredSetting& row : rows) {
      if (!best->options.budget && !with_knobs(row.knobs).budget) row.bytes *= made->bytes / expected.bytes;
      row.seconds *= made->seconds / expected.seconds;
      row.held_out += made->held_out - expected.held_out;
    }
    result.tried.push_back(*best);
    result.met = meets(limits, *made);
    if (result.met || rank_of(limits, *made) < rank_of(limits, result.tried.front().made))
      result.nearest = turn;
    if (result.met) break;
  }
  return result;
}

}  // namespace selvedge
