#include "converter/stitch/relax_chain.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace selvedge {

std::vector<V3d> resampled(const RelaxChain& chain, std::size_t count) {
  const double step = chain.length() / static_cast<double>(count);
  std::vector<V3d> points;
  double walked = 0;
  for (std::size_t i = 0; i < chain.points.size() && points.size() < count; ++i) {
    const V3d a = chain.points[i];
    const V3d b = chain.next_point(i);
    const double length = (b - a).length();
    while (points.size() < count && static_cast<double>(points.size()) * step <= walked + length) {
      const double part = (static_cast<double>(points.size()) * step - walked) / std::max(length, 1e-300);
      points.push_back(a + (b - a) * std::clamp(part, 0.0, 1.0));
    }
    walked += length;
  }
  while (points.size() < count) points.push_back(chain.points.back());  // rounding at the very end
  return points;
}

void smooth(RelaxChain& chain, double time, double bending) {
  const std::size_t count = chain.points.size();
  chain.spacing = chain.length() / static_cast<double>(count);
  const double stretch = chain.radius * chain.radius / (chain.spacing * chain.spacing);
  const double pull = time * stretch;
  const double bend = pull * bending * bending * stretch;
  const auto felt = static_cast<std::size_t>(40 * std::sqrt(std::sqrt(bend))) + 16;  // points, to 1e-12
  double near = 0, far = 0, pivot = 1e300, before = pivot;
  for (std::size_t i = 0; i < felt; ++i) {
    far = bend / before;
    near = -(pull + 4 * bend + bend * near) / pivot;
    before = std::exchange(pivot, 1 + 2 * pull + 6 * bend - near * near * pivot - far * far * before);
  }
  // The periodic part: the offset from the straight line between one repeat and the next.
  const V3d step = chain.period_offset / static_cast<double>(count);
  for (std::size_t i = 0; i < count; ++i) chain.points[i] -= step * static_cast<double>(i);
  std::vector<V3d> swept(count);
  const auto sweep = [&](const std::vector<V3d>& from, std::vector<V3d>& to, bool back) {
    V3d last(0), second(0);
    for (std::size_t k = 0, i = (count - felt % count) % count; k < felt + count;
         ++k, i = i + 1 < count ? i + 1 : 0) {
      const std::size_t at = back ? count - 1 - i : i;
      const V3d value = from[at] - last * near - second * far;
      second = std::exchange(last, value);
      to[at] = value;
    }
  };
  sweep(chain.points, swept, false);
  for (V3d& p : swept) p /= pivot;
  sweep(swept, chain.points, true);
  for (std::size_t i = 0; i < count; ++i) chain.points[i] += step * static_cast<double>(i);
}

}  // namespace selvedge
