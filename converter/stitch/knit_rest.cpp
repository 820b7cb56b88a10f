// Brings a drawn knit to rest (knit_cloth.h): relax() of a knit.
//
// A loop keeps the length that the table gives it. Plain knit of the same yarn is laid at the gauge first:
// the bends of its loops are in part set, as knitted yarn's are, and its free size says how cloth that is
// left to itself lies beside cloth of the gauge.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "converter/stitch/knit_cloth.h"
#include "converter/stitch/yarn_relax.h"

namespace selvedge {
namespace {

/// Fraction of the bends of plain knit's loops that is set in the yarn.
constexpr double set_bend = 0.2;

/// Largest radius that is tried, as a fraction of the smaller side of a stitch: thicker yarn has no room, and
/// in its push the repeat would lose its shape.
constexpr double max_radius = 0.35;

/// Steps to its own size, and at the gauge; and for a preview.
constexpr int free_steps = 200;
constexpr int gauge_steps = 45;
constexpr int rough_steps = 20;
constexpr int edit_steps = 6;
/// Progress after the first of both.
constexpr double free_part = 0.6;

/// Takes what a cloth has given, with its radii.
void take(const KnitCloth& cloth, DrawnKnit knit, RelaxResult& rested) {
  for (Yarn& yarn : knit.pattern.yarns) {
    yarn.radius_mm *= cloth.radius_fraction();
    if (!yarn.squeezes.empty()) yarn.flattening = 1;
  }
  rested.pattern = std::move(knit.pattern);
  rested.parts = std::move(knit.parts);
  rested.steps = cloth.steps();
  rested.residual = cloth.residual();
}

/// Yarns, from the first on, of which the drawing is copies above each other: stripes differ in colours
/// alone.
std::size_t yarns_of_repeat(const StitchPattern& drawn, const std::vector<std::vector<KnitPart>>& parts) {
  const std::size_t count = drawn.yarns.size();
  const auto are_copies = [&](const Yarn& a, const Yarn& b, double shift) {
    const double rounding = 1e-6 * a.radius_mm;
    return a.radius_mm == b.radius_mm && a.flattening == b.flattening &&
           (a.fibre_kind != 0) == (b.fibre_kind != 0) &&
           std::ranges::equal(a.segments, b.segments, [&](const BezierSegment& s, const BezierSegment& t) {
             return std::ranges::equal(s, t, [&](const V3d& p, const V3d& q) {
               return q.equalWithAbsError(p + V3d(0, shift, 0), rounding);
             });
           });
  };
  for (std::size_t few = 1; few < count; ++few) {
    const double shift = drawn.period_mm.y * static_cast<double>(few) / static_cast<double>(count);
    bool repeats = count % few == 0;
    for (std::size_t y = 0; y + few < count && repeats; ++y)
      repeats = parts[y] == parts[y + few] && are_copies(drawn.yarns[y], drawn.yarns[y + few], shift);
    if (repeats) return few;
  }
  return count;
}

/// Brings the first yarns to rest, and lays their copies above them.
RelaxResult rest_repeat(const StitchPattern& drawn, RelaxOptions options, std::size_t yarns) {
  const std::size_t count = drawn.yarns.size();
  const double times = static_cast<double>(count) / static_cast<double>(yarns);
  StitchPattern few = drawn;
  few.yarns.resize(yarns);
  few.period_mm.y /= times;
  options.blocked_mm.y /= times;
  options.parts.resize(yarns);
  options.stripes = static_cast<int>(count / yarns);
  RelaxResult rested = rest_knit(few, options);
  const V3d step(rested.lean * rested.pattern.period_mm.y, rested.pattern.period_mm.y, 0);
  for (std::size_t y = yarns; y < count; ++y) {
    rested.parts.push_back(rested.parts[y - yarns]);
    const Yarn& copied = rested.pattern.yarns[y - yarns];
    Yarn yarn = drawn.yarns[y];
    yarn.radius_mm = copied.radius_mm;
    yarn.flattening = copied.flattening;
    yarn.squeezes = copied.squeezes;
    yarn.segments = copied.segments;
    for (BezierSegment& segment : yarn.segments)
      for (V3d& p : segment) p += step;
    rested.pattern.yarns.push_back(std::move(yarn));
  }
  rested.pattern.period_mm.y *= times;
  rested.free_mm.y *= times;
  return rested;
}

/// Sets the least number of repeats, of so many loops each, that stand on each other and end whole periods to
/// the side, at a lean within a degree of the free one. Too many stay straight.
void find_laps(const V2d& period, std::size_t loops, RelaxResult& result) {
  constexpr std::size_t max_loops = 256;
  constexpr double max_turn = 0.0175;
  for (int lean_repeats = 1; lean_repeats * loops <= max_loops; ++lean_repeats) {
    const double height = lean_repeats * period.y;
    const double lean = std::round(height * result.free_lean / period.x) * period.x / height;
    if (std::abs(std::atan(lean) - std::atan(result.free_lean)) > max_turn) continue;
    result.lean = lean;
    result.lean_repeats = lean_repeats;
    return;
  }
}

}  // namespace

RelaxResult rest_knit(const StitchPattern& pattern, const RelaxOptions& options) {
  const std::size_t repeat = yarns_of_repeat(pattern, options.parts);
  if (repeat < pattern.yarns.size() && options.last == nullptr) return rest_repeat(pattern, options, repeat);
  const V2d gauge = options.gauge_mm;
  StitchPattern drawn = pattern;
  double thickest = 0;
  for (const Yarn& yarn : drawn.yarns) thickest = std::max(thickest, yarn.radius_mm);
  const double thinned = std::min(1.0, max_radius * std::min(gauge.x, gauge.y) / thickest);
  for (Yarn& yarn : drawn.yarns) yarn.radius_mm *= thinned;
  const DrawnKnit plain_knit =
      draw_knit({{{ChartStitch()}}, gauge.x, gauge.y, false, {drawn.yarns.front()}}, drawn.name);
  KnitCloth straight(plain_knit, options.gap_radii, {});
  straight.rest({.grows = true});
  std::vector<double> curvature = straight.curvature();
  for (double& c : curvature) c *= set_bend;
  DrawnKnit knit{std::move(drawn), options.parts};
  if (options.last != nullptr) {
    KnitCloth edited(knit, options.gap_radii, curvature);
    if (edited.edit(knit, *options.last, gauge)) {
      edited.rest({.grows = true, .max_steps = edit_steps});
      edited.rest({.presses = true, .max_steps = gauge_steps});
      edited.give(knit);
      RelaxResult rested = options.last->relaxed;
      take(edited, std::move(knit), rested);
      rested.is_edit = true;
      return rested;
    }
  }
  KnitCloth first(plain_knit, options.gap_radii, curvature);
  first.rest({.grows = true, .is_free = true});
  // Once more from there, as the cloth will: it is measured along the same way.
  const V2d begin = first.period() / gauge;
  KnitCloth plain(plain_knit, options.gap_radii, curvature);
  plain.rest({.grows = true, .is_free = true, .period_mm = gauge * begin, .float_factor = begin.x});
  KnitCloth cloth(knit, options.gap_radii, curvature);
  if (options.free_part < 1) cloth.find_kinds();  // a sampler's, which stand for many
  const auto tell = [&](double from, double to, int steps) {
    if (options.progress)
      cloth.on_step([&, from, to, steps, begin = cloth.steps()] {
        options.progress(std::min(to, from + (to - from) * (cloth.steps() - begin) / steps));
      });
  };
  // Mostly, after some 50 steps of stages.
  tell(0, free_part, 50 + free_steps);
  // Floats span what plain knit behind them would.
  cloth.rest({.grows = true,
              .is_free = true,
              .period_mm = knit.pattern.period_mm * begin,
              .float_factor = begin.x,
              .max_steps = options.is_rough ? rough_steps : free_steps});
  RelaxResult result;
  const bool is_free = options.blocked_mm == V2d(0) && !options.is_rough && options.free_part == 1;
  if (is_free) cloth.find_lean(free_steps);
  const V2d free = cloth.period() * gauge / plain.period();
  V2d period = free;
  if (options.free_part < 1) period = pattern.period_mm + (free - pattern.period_mm) * options.free_part;
  result.free_lean = cloth.lean() * free.x / free.y * cloth.period().y / cloth.period().x;
  std::size_t loops = 0;
  for (const auto& parts : options.parts) loops += parts.size();
  find_laps(V2d(free.x, free.y * options.stripes), loops * options.stripes, result);
  for (int k = 0; k < 2; ++k)
    if (options.blocked_mm[k] > 0) period[k] = options.blocked_mm[k];
  tell(free_part, 1, 50 + 3 * gauge_steps);
  cloth.rest({.presses = true,
              .period_mm = period,
              .lean = result.lean,
              .max_steps = options.is_rough ? rough_steps : gauge_steps});
  cloth.give(knit);
  double low = 0;
  double high = 0;
  for (const Yarn& yarn : knit.pattern.yarns) {
    for (const BezierSegment& segment : yarn.segments) {
      low = std::min(low, segment[0].z - yarn.radius_mm);
      high = std::max(high, segment[0].z + yarn.radius_mm);
    }
  }
  for (Yarn& yarn : knit.pattern.yarns)
    for (BezierSegment& segment : yarn.segments)
      for (V3d& p : segment) p.z -= 0.5 * (low + high);
  constexpr double min_part = 0.75;
  const double fraction = thinned * cloth.radius_fraction();
  take(cloth, std::move(knit), result);
  result.radius_fraction = fraction;
  result.has_settled = fraction >= min_part;
  result.free_mm = free;
  result.stretch = cloth.stretch();
  return result;
}

}  // namespace selvedge
