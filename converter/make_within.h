// make within limits: which setting is the cheapest that meets them.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "converter/quality.h"

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
  double held_out = 0;  ///< dB, as ExpectedPoint's; NaN where it was not asked for
};

/// Whether all limits are met.
bool meets(const MakeLimits& limits, const MakeFigures& figures);

/// How far the figures are from the limits: 0 where they meet them, else the largest of the missing decibels
/// and of the octaves of bytes or seconds too many.
double distance_from(const MakeLimits& limits, const MakeFigures& figures);

/// A setting with what was expected of it just before it was made, and what came out.
struct MadePoint {
  TradePoint point;
  MakeFigures expected;
  MakeFigures made;
};

struct Chosen {
  std::optional<std::size_t> kept;  ///< index into `tried`
  std::vector<MadePoint> tried;     ///< in their order
  TradePoint nearest;               ///< where none is kept: what comes nearest ...
  MakeFigures nearest_figures;      ///< ... with what it came or is expected to come to
};

/// Makes settings of `table` until one meets the limits. With a least quality, the cheapest in time; else the
/// best that is within the limits. Where quality or time counts the cheapest of all is made first: what it
/// comes to corrects what is expected of the others for this stitch and this machine. `make` makes a setting;
/// its errors end the search.
Result<Chosen> choose_within(std::span<const ExpectedPoint> table, const MakeLimits& limits, int threads,
                             const std::function<Result<MakeFigures>(const TradePoint&)>& make);

}  // namespace selvedge
