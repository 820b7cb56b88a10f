#include "converter/stitch/pattern.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "converter/stitch/fibres.h"
#include "converter/stitch/parameters.h"
#include "format/fabric/yarn_hairs.h"
#include "format/fabric/yarn_section.h"

namespace selvedge {
namespace {

constexpr double max_twist = 1;  ///< turns per length of one radius

bool is_finite(const V3d& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

V2d turns_unrounded(const Yarn& yarn, const V2d& period_mm) {
  const V3d way = yarn.segments.back()[3] - yarn.segments.front()[0];
  return {way.x / period_mm.x, way.y / period_mm.y};
}

Result<void> validate_yarn(const Yarn& yarn, const V2d& period_mm, const std::string& file,
                           const std::string& place, const StitchLimits& limits) {
  const auto refuse = [&](const std::string& where, std::string why) {
    return fail(Code::stitch_invalid, file, place + where, std::move(why));
  };
  const double shorter = std::min(period_mm.x, period_mm.y);
  const double longer = std::max(period_mm.x, period_mm.y);
  if (!(yarn.radius_mm >= limits.min_mm && yarn.radius_mm <= limits.max_mm))
    return refuse("/radius_mm", fmt::format("radius must lie in {} to {} mm, is {}", limits.min_mm,
                                            limits.max_mm, yarn.radius_mm));
  if (yarn.radius_mm > limits.radius_periods * shorter)
    return refuse("/radius_mm", fmt::format("radius {} mm is more than {} times the shorter period {} mm",
                                            yarn.radius_mm, limits.radius_periods, shorter));
  for (const auto& [name, value, min] :
       {std::tuple("albedo/0", yarn.albedo.x, 0.0F), std::tuple("albedo/1", yarn.albedo.y, 0.0F),
        std::tuple("albedo/2", yarn.albedo.z, 0.0F), std::tuple("gloss", yarn.gloss.weight, 0.0F),
        std::tuple("roughness", yarn.gloss.roughness, std::numeric_limits<float>::min()),
        std::tuple("flattening", static_cast<float>(yarn.flattening), min_flattening)})
    if (!(value >= min && value <= 1))
      return refuse(fmt::format("/{}", name), fmt::format("must lie in [{}, 1], is {}", min, value));
  if (!(std::abs(yarn.twist_per_mm) * yarn.radius_mm <= max_twist))
    return refuse("/twist_per_mm", fmt::format("{} turns per mm are more than {} per radius of {} mm",
                                               yarn.twist_per_mm, max_twist, yarn.radius_mm));
  if (yarn.fibre_kind < 0 || yarn.fibre_kind >= static_cast<int>(yarn_kinds().size()))
    return refuse("/fibre", fmt::format("there is no fibre {}", yarn.fibre_kind));
  for (const YarnMember& m : yarn_members()) {
    const double value = m.get(yarn);
    if (!m.is_enforced_in_patterns || (value >= m.min && value <= m.max)) continue;
    return refuse(fmt::format("/{}", m.name),
                  fmt::format("{} must lie in [{}, {}], is {}", m.name, m.min, m.max, value));
  }
  if (yarn.hairiness > 0 && !(yarn.hair_mm > 0 && max_hair_length_ratio * yarn.hair_mm <= shorter))
    return refuse("/hair_mm", fmt::format("hairs of {} mm on average, the longest {} times as long, must be "
                                          "longer than 0 and no longer than the shorter period {} mm",
                                          yarn.hair_mm, max_hair_length_ratio, shorter));
  if (yarn.segments.empty()) return refuse("/segments", "the yarn has no segments");
  for (std::size_t s = 0; s < yarn.squeezes.size(); ++s)
    if (!(yarn.squeezes[s].length2() <= 1 - double{min_flattening}))
      return refuse(fmt::format("/squeezes/{}", s),
                    fmt::format("its square must be at most {}", 1 - min_flattening));
  const double tolerance = chain_tolerance * yarn.radius_mm;
  for (std::size_t s = 0; s < yarn.segments.size(); ++s) {
    for (std::size_t p = 0; p < 4; ++p) {
      const V3d& point = yarn.segments[s][p];
      if (!is_finite(point))
        return refuse(fmt::format("/segments/{}/{}", s, p), "the control point is not finite");
      const double reach = std::max(
          {std::abs(point.x) / period_mm.x, std::abs(point.y) / period_mm.y, std::abs(point.z) / longer});
      if (reach > limits.reach_periods)
        return refuse(
            fmt::format("/segments/{}/{}", s, p),
            fmt::format("the control point is more than {} periods from the origin", limits.reach_periods));
    }
    if (s == 0) continue;
    const double gap = (yarn.segments[s][0] - yarn.segments[s - 1][3]).length();
    if (gap > tolerance)
      return refuse(fmt::format("/segments/{}", s),
                    fmt::format("starts {:.6g} mm from the end of the segment before", gap));
  }
  const V2d turns = turns_unrounded(yarn, period_mm);
  const double gap =
      V3d((turns.x - std::round(turns.x)) * period_mm.x, (turns.y - std::round(turns.y)) * period_mm.y,
          yarn.segments.back()[3].z - yarn.segments.front()[0].z)
          .length();
  if (gap > tolerance)
    return refuse(fmt::format("/segments/{}", yarn.segments.size() - 1),
                  fmt::format("ends {:.6g} mm from where the chain starts again, whole periods aside", gap));
  return {};
}

}  // namespace

Result<void> validate(const StitchPattern& pattern, const std::string& file, const StitchLimits& limits) {
  for (unsigned i = 0; i < 2; ++i)
    if (!(pattern.period_mm[i] >= limits.min_mm && pattern.period_mm[i] <= limits.max_mm))
      return fail(Code::stitch_invalid, file, fmt::format("/period_mm/{}", i),
                  fmt::format("the period must lie in {} to {} mm, is {}", limits.min_mm, limits.max_mm,
                              pattern.period_mm[i]));
  if (pattern.yarns.empty()) return fail(Code::stitch_invalid, file, "/yarns", "the pattern has no yarn");
  std::size_t segments = 0;
  for (std::size_t y = 0; y < pattern.yarns.size(); ++y) {
    const std::string place = fmt::format("/yarns/{}", y);
    segments += pattern.yarns[y].segments.size();
    if (segments > static_cast<std::size_t>(limits.segments))
      return fail(Code::stitch_invalid, file, place + "/segments",
                  fmt::format("more than {} segments in the pattern", limits.segments));
    if (auto sound = validate_yarn(pattern.yarns[y], pattern.period_mm, file, place, limits); !sound)
      return sound;
  }
  return {};
}

V2i chain_periods(const Yarn& yarn, const V2d& period_mm) {
  const V2d turns = turns_unrounded(yarn, period_mm);
  return {static_cast<int>(std::lround(turns.x)), static_cast<int>(std::lround(turns.y))};
}

StitchPattern close_lean(const StitchPattern& pattern, double lean, int lean_repeats) {
  StitchPattern result = pattern;
  result.period_mm.y *= lean_repeats;
  for (int repeat = 1; repeat < lean_repeats; ++repeat) {
    const V3d up(repeat * lean * pattern.period_mm.y, repeat * pattern.period_mm.y, 0);
    for (Yarn yarn : pattern.yarns) {
      for (BezierSegment& segment : yarn.segments)
        for (V3d& p : segment) p += up;
      result.yarns.push_back(std::move(yarn));
    }
  }
  return result;
}

StitchPattern repeat_pattern(const StitchPattern& pattern, int count) {
  if (count == 1) return pattern;
  StitchPattern result = pattern;
  result.period_mm *= count;
  result.yarns.clear();
  const auto wrapped = [&](int repeat) { return (repeat % count + count) % count; };
  for (const Yarn& yarn : pattern.yarns) {
    const V2i turns = chain_periods(yarn, pattern.period_mm);
    const int passes = count / std::gcd(count, std::gcd(turns.x, turns.y));
    std::vector<bool> is_laid(static_cast<std::size_t>(count) * count, false);
    for (int start = 0; start < count * count; ++start) {
      if (is_laid[start]) continue;
      Yarn chain = yarn;
      chain.segments.clear();
      chain.squeezes.clear();
      for (int pass = 0; pass < passes; ++pass) {
        const V2i repeat = V2i(start % count, start / count) + turns * pass;
        is_laid[wrapped(repeat.y) * count + wrapped(repeat.x)] = true;
        const V3d offset(repeat.x * pattern.period_mm.x, repeat.y * pattern.period_mm.y, 0);
        chain.squeezes.insert(chain.squeezes.end(), yarn.squeezes.begin(), yarn.squeezes.end());
        for (BezierSegment segment : yarn.segments) {
          for (V3d& point : segment) point += offset;
          chain.segments.push_back(segment);
        }
      }
      result.yarns.push_back(std::move(chain));
    }
  }
  return result;
}

}  // namespace selvedge
