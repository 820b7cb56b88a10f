#include "converter/stitch/blocking.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "converter/stitch/chart.h"
#include "format/base/guard.h"

namespace selvedge {
namespace {

constexpr std::array<const char*, 2> names{"width_mm", "height_mm"};

/// Yarn that is longer than its loops by more than this has no room.
constexpr double max_stretch = 0.02;
/// Sizes, as multiples of plain knit's, beyond which no cloth is tried.
constexpr double min_size = 0.3;
constexpr double max_size = 3;
/// Tries to find the nearest size that has room.
constexpr int tries = 4;

}  // namespace

std::vector<StitchParameter> blocking_parameters(const V2d& period_mm) {
  std::vector<StitchParameter> parameters;
  for (int k = 0; k < 2; ++k)
    parameters.push_back({names[k],
                          {period_mm[k]},
                          min_stitch_mm,
                          max_relaxed_stitches * max_stitch_mm,
                          "of the repeat, which is blocked, as on a board; not set, it is free"});
  return parameters;
}

bool set_blocked_size(const V2d& size_mm, StitchSettings& settings) {
  bool free = true;
  for (int k = 0; k < 2; ++k) free = settings.try_emplace(names[k], std::vector{size_mm[k]}).second && free;
  return free;
}

RelaxResult rest_blocked(const std::string& name, const StitchValues& values, const StitchPattern& drawn,
                         RelaxOptions options, const Relaxer& relaxer) {
  bool is_set = false;
  bool is_hopeless = false;
  V2d& size = options.blocked_mm;
  for (int k = 0; k < 2; ++k) {
    if (!values.is_set(names[k])) continue;
    is_set = true;
    size[k] = values.number(names[k]);
    is_hopeless |= size[k] < min_size * drawn.period_mm[k] || size[k] > max_size * drawn.period_mm[k];
  }
  const V2d asked = size;
  if (is_hopeless) size = V2d(0, 0);
  RelaxResult result = relaxer(drawn, options);
  const bool is_blocked = asked.length2() > 0;
  if (!is_hopeless && (!is_blocked || result.stretch <= max_stretch) && (!is_set || result.has_settled))
    return result;
  const V2d free = result.free_mm;
  V2d goal = free;
  for (int k = 0; k < 2; ++k)
    if (asked[k] > 0)
      goal[k] = std::clamp(asked[k], min_size * drawn.period_mm[k], max_size * drawn.period_mm[k]);
  double part = 0;
  options.is_rough = true;
  for (double step = 0.5; step >= 1.0 / (1 << tries); step /= 2) {
    size = free + (goal - free) * (part + step);
    const RelaxResult tried = relaxer(drawn, options);
    if (tried.has_settled && tried.stretch <= max_stretch) part += step;
  }
  const V2d nearest = free + (goal - free) * part;
  throw Failure{
      {Code::option_out_of_range, name,
       is_set ? fmt::format("--set {}", fmt::join(names, ", ")) : "--set wale_mm, course_mm",
       fmt::format("the repeat cannot be blocked to {:.4g} x {:.4g} mm: free it takes {:.4g} x {:.4g}, and "
                   "about {:.4g} x {:.4g} is the nearest that has room",
                   asked.x > 0 ? asked.x : free.x, asked.y > 0 ? asked.y : free.y, free.x, free.y, nearest.x,
                   nearest.y)}};
}

}  // namespace selvedge
