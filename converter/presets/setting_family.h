// What settings are expected to come to that nobody measured: layers chosen within other budgets, and with
// other texels.
//
// A family are the settings that differ in their budget alone. Its seconds are those of its rows, whatever
// the budget. Its decibels are linear in the logarithm of bytes between its rows. Above them they rise half
// as fast as the last two rows do. So many octaves o below them they are `fall` o (1 + o / 2) fewer, where
// `fall` is twice the slope of the first two rows, at least 1.5 dB: there the file is soon little more than
// its head. One row alone has the mean slope of the families with the same kind of layers, or, where those
// have none either, 0.75 dB per octave.
//
// Where two families differ in nothing but their texels, one having twice as many along a side, a further one
// is expected beyond either, between 8 and 64 texels, unless it was measured. Twice the texels want twice the
// bytes, and the two differ by d decibels and a factor r of seconds. The coarser has half the bytes, d fewer
// decibels, and takes 1 / sqrt(r) of the time; the finer has twice the bytes, d / 2 more decibels, and takes
// four times as long, or r times where that is more.
#pragma once

#include "converter/presets/presets.h"

namespace selvedge {

struct SettingFamily {
  TradePoint setting;               ///< budget 0
  std::vector<ExpectedPoint> rows;  ///< by bytes; one where the layers are not chosen within a budget
  double rise = 0;                  ///< dB per octave of bytes above the rows
  double fall = 0;                  ///< at their lower end
};

/// Those of the rows, in their order, then those that follow from them.
std::vector<SettingFamily> families_of(std::span<const ExpectedPoint> rows);

/// The setting with this budget (of a family without budgets: 0). As much is expected to be used as the
/// budget allows, but no more than the dearest row has, if that left a tenth of its own budget unused.
ExpectedPoint expected_at(const SettingFamily& family, std::uint64_t budget);

/// Decibels expected at so many bytes.
double held_out_at(const SettingFamily& family, double bytes);

/// The budgets that the model is good for, bytes: from a quarter of what its cheapest row has to four times
/// its dearest one's budget, or that budget where it was not used up. Eight to the octave and the rows' own,
/// rising; for a family without budgets 0 alone.
std::vector<std::uint64_t> budgets_of(const SettingFamily& family);

}  // namespace selvedge
