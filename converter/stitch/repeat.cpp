#include "converter/stitch/repeat.h"

#include <numeric>

namespace selvedge {

StitchPattern repeated(const StitchPattern& pattern, int count) {
  if (count == 1) return pattern;
  StitchPattern result = pattern;
  result.period_mm *= count;
  result.yarns.clear();
  const auto wrapped = [&](int repeat) { return (repeat % count + count) % count; };
  for (const Yarn& yarn : pattern.yarns) {
    const V2i turns = turns_of(yarn, pattern.period_mm);
    const int passes = count / std::gcd(count, std::gcd(turns.x, turns.y));
    std::vector<bool> is_laid(static_cast<std::size_t>(count) * count, false);
    for (int start = 0; start < count * count; ++start) {
      if (is_laid[start]) continue;
      Yarn chain = yarn;
      chain.segments.clear();
      for (int pass = 0; pass < passes; ++pass) {
        const V2i repeat = V2i(start % count, start / count) + turns * pass;
        is_laid[wrapped(repeat.y) * count + wrapped(repeat.x)] = true;
        const V3d offset(repeat.x * pattern.period_mm.x, repeat.y * pattern.period_mm.y, 0);
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
