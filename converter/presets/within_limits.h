// Makes a fabric within limits of bytes, quality and time: looks up a measured setting, makes it, and
// corrects it once.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "converter/presets/presets.h"

namespace selvedge {

/// Limits of a make. All that are set have to be met.
struct MakeLimits {
  std::optional<std::uint64_t> bytes;  ///< of the file, at most
  std::optional<double> held_out;      ///< dB, at least, as in MeasuredSetting
  std::optional<double> seconds;       ///< elapsed time of bake and fit, at most
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
  std::size_t nearest = 0;          ///< index into `tried`: meets the limits, or comes nearest to them
  bool met = false;
};

/// Makes the best row of `table` (not empty). If it misses the limits, the table is corrected by its figures
/// (decibels by a difference; seconds, and bytes of settings without a budget, by a factor) and the row that
/// is best then is made. There is no third try.
///
/// With a limit of quality the best row is the cheapest in time, then in bytes, that meets all limits;
/// without it the row with most decibels. If no row meets them, cost comes first: the row with the smallest
/// excess in octaves (the larger one of bytes and seconds), then with the fewest decibels missing. The limit
/// of bytes replaces the budget of a row, unless that is smaller and meets a limit of quality.
///
/// Rows with fewer than `min_texels` per side are ignored; seconds of the table are divided by `threads`.
/// `base` has the options that are not knobs. `make` makes a setting; its errors end the search, also that of
/// a budget too small for any fabric.
Result<WithinLimits> make_within(std::span<const MeasuredSetting> table, const MakeLimits& limits,
                                 const MakeOptions& base, int min_texels, int threads,
                                 const std::function<Result<MakeFigures>(const MakeOptions&)>& make);

}  // namespace selvedge
