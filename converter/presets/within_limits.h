// Makes a fabric within limits of bytes, quality and time: a measured setting is looked up, made, and
// corrected once.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "converter/presets/presets.h"

namespace selvedge {

/// All that are given have to be met.
struct MakeLimits {
  std::optional<std::uint64_t> bytes;  ///< of the file, at most
  std::optional<double> held_out;      ///< dB, at least, as MeasuredSetting has it
  std::optional<double> seconds;       ///< by the clock, to bake and fit, at most
  bool any() const { return bytes || held_out || seconds; }
};

/// The cost and the quality of a fabric, expected or made.
struct MakeFigures {
  double bytes = 0;
  double seconds = 0;
  double held_out = 0;  ///< dB
};

bool meets(const MakeLimits& limits, const MakeFigures& figures);

struct TriedSetting {
  MakeOptions options;
  MakeFigures expected;  ///< by the table
  MakeFigures made;
};

struct WithinLimits {
  std::vector<TriedSetting> tried;  ///< one or two
  std::size_t nearest = 0;          ///< index into `tried`: the one that meets the limits or lacks the least
  bool met = false;
};

/// Looks up a row of `table` (not empty) and makes it. If it does not meet the limits, the table is corrected
/// by what came out (decibels by a difference; seconds, and bytes of settings without a budget, by a factor)
/// and the row that is then the best is made. There is no third try.
///
/// With a limit of quality the best row is the cheapest in time, then in bytes, that meets all limits;
/// without it the row with most decibels. Where no row does, limits of cost go first: the row with the fewest
/// octaves of bytes or seconds too many, whichever are more, then with the fewest decibels missing. A row
/// that chooses its layers within a budget is made within the limit of bytes where its own budget is larger
/// or its decibels are wanted.
///
/// Rows of fewer than `min_texels` a side do not count; seconds of the table are divided by `threads`. `base`
/// has the options that are no knobs. `make` makes a setting; its errors end the search, also that of a
/// budget that no fabric is small enough for.
Result<WithinLimits> make_within(std::span<const MeasuredSetting> table, const MakeLimits& limits,
                                 const MakeOptions& base, int min_texels, int threads,
                                 const std::function<Result<MakeFigures>(const MakeOptions&)>& make);

}  // namespace selvedge
