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

/// Correction of the table's means for a stitch and a machine.
struct Correction {
  double bytes = 1;  ///< of settings without a budget
  double seconds = 1;
  double held_out = 0;
};

MakeFigures corrected(const MeasuredSetting& row, bool has_budget, const Correction& c) {
  return {row.bytes * (has_budget ? 1 : c.bytes), row.seconds * c.seconds, row.held_out + c.held_out};
}

/// The row's options within the limits.
TriedSetting setting_of(const MeasuredSetting& row, const MakeLimits& limits, const MakeOptions& base,
                        const Correction& correction) {
  TriedSetting setting{with_knobs(row.knobs, base), {}, {}};
  auto& budget = setting.options.budget;
  setting.expected = corrected(row, budget.has_value(), correction);
  if (budget && limits.bytes) {
    const bool enough = limits.held_out && setting.expected.held_out >= *limits.held_out;
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
  Correction correction{1, 1.0 / threads, 0};
  WithinLimits result;
  for (int turn = 0; turn < 2; ++turn) {
    const MeasuredSetting* row = nullptr;
    TriedSetting best;
    for (const MeasuredSetting& other : table) {
      TriedSetting setting = setting_of(other, limits, base, correction);
      if (setting.options.bake.width < min_texels) continue;
      if (turn > 0 && settings_name(setting.options) == settings_name(result.tried.front().options)) continue;
      if (row != nullptr && rank_of(limits, setting.expected) >= rank_of(limits, best.expected)) continue;
      row = &other;
      best = std::move(setting);
    }
    if (row == nullptr) break;
    const auto made = make(best.options);
    if (!made) return tl::unexpected(made.error());
    best.made = *made;
    correction = {best.options.budget ? 1 : made->bytes / row->bytes, made->seconds / row->seconds,
                  made->held_out - row->held_out};
    result.tried.push_back(std::move(best));
    result.met = meets(limits, *made);
    if (result.met || rank_of(limits, *made) < rank_of(limits, result.tried.front().made))
      result.nearest = turn;
    if (result.met) break;
  }
  return result;
}

}  // namespace selvedge
