// Figures of time, and the machine that they were measured on.
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>

#include "format/base/error.h"

namespace selvedge {

/// By the clock, and the work of all cores, which other programs do not change.
struct Seconds {
  double wall = 0;
  double processor = 0;
};

/// How long it takes by the clock, or its error.
Result<double> clocked(const std::function<Result<void>()>& run);

/// Medians (of an even number the lower of the two in the middle) of `repeats` runs, at least one. Each run
/// gives its seconds by the clock; an error ends them.
Result<Seconds> timed(int repeats, const std::function<Result<double>()>& run);

/// `processor` (its model, or "unknown"), `cores` that programs can use at once, and `threads`
/// (thread_count()).
nlohmann::ordered_json machine_json();

}  // namespace selvedge
