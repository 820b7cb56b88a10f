// make within limits: which setting is the cheapest that meets them.
#pragma once

#include <compare>
#include <functional>
#include <optional>
#include <vector>

#include "converter/presets/presets.h"

namespace selvedge {

/// What a fabric may cost and has to be worth. Any that are given have to be met.
struct MakeLimits {
  std::optional<std::uint64_t> bytes;  ///< of the file
  std::optional<double> held_out;      ///< dB at least, as ExpectedPoint's (quality.h)
  std::optional<double> seconds;       ///< to bake and fit
  bool any() const { return bytes || held_out || seconds; }
};

/// What a setting comes to, expected or made.
struct MakeFigures {
  double bytes = 0;
  double seconds = 0;   ///< by the clock, to bake and fit
  double held_out = 0;  ///< dB, as ExpectedPoint's
};

/// Whether all limits are met.
bool meets(const MakeLimits& limits, const MakeFigures& figures);

/// What figures lack of the limits; the less, the nearer. What costs too much is farther than what is not
/// good enough: a limit of cost that can be met is met, however bad the quality, and among all that meet them
/// the decibels count.
struct Shortfall {
  double octaves = 0;   ///< of bytes or seconds too many, whichever are more
  double decibels = 0;  ///< missing
  auto operator<=>(const Shortfall&) const = default;
};
/// All 0 where the limits are met.
Shortfall shortfall_of(const MakeLimits& limits, const MakeFigures& figures);

/// A setting with what was expected of it just before it was made, and what came out.
struct MadePoint {
  TradePoint point;
  MakeFigures expected;
  MakeFigures made;
  /// No fabric is small enough for its budget: `made` is of the smallest there is.
  bool too_large() const;
};

struct Chosen {
  std::optional<std::size_t> kept;  ///< index into `tried`
  std::vector<MadePoint> tried;     ///< in their order
  TradePoint nearest;               ///< where none is kept: what comes nearest ...
  MakeFigures nearest_figures;      ///< ... with what it came or is expected to come to
  bool nearest_made = false;
};

/// No more settings than this are made for one search.
inline constexpr std::size_t max_tries = 12;

/// Makes settings until one meets the limits: those of `table`, and those with other budgets and texels that
/// follow from them (setting_family.h), `min_texels` a side or more. With a least quality the cheapest in
/// time, then in bytes, that is expected to meet them; else the best within them, where without a limit of
/// bytes the budgets are those of the table.
///
/// Where quality or time counts the cheapest row of all is made first. What was made corrects what is
/// expected of the rest, for this stitch and this machine: decibels by a difference and seconds by a factor,
/// from the last one of the same family, else of the same kind of layers, else of all; bytes by a factor, of
/// settings without a budget from such. Of a family no more than three are made, of all no more than
/// `max_tries`.
///
/// Where none meets them, what is expected to come nearest (Shortfall) is made, too, twice at most, and only
/// if that is expected to take a minute at most.
///
/// `make` makes a setting. Where no fabric is as small as its budget it is to make the smallest, which counts
/// as not meeting the limits. Its errors end the search. `table`: not empty.
Result<Chosen> choose_within(std::span<const ExpectedPoint> table, const MakeLimits& limits, int min_texels,
                             int threads, const std::function<Result<MakeFigures>(const TradePoint&)>& make);

}  // namespace selvedge
