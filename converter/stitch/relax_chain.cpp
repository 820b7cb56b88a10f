#include "converter/stitch/relax_chain.h"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

namespace selvedge {
namespace {

/// Logarithm of the largest width of soft sections, in radii (thickness is 0.3 of it).
constexpr double max_stretch = 0.6019864021629680;

/// exp(x) for |x| < 1, to 1e-8, of the same bits everywhere.
double exp_of(double x) {
  double power = (2048 + x) / (2048 - x);
  for (int i = 0; i < 10; ++i) power *= power;
  return power;
}

}  // namespace

std::vector<V3d> resampled(const RelaxChain& chain, std::size_t count, std::size_t parts) {
  std::vector<V3d> points;
  const std::size_t old = chain.points.size() / parts;
  for (std::size_t part = 0, first = 0; part < parts; ++part, first += old) {
    const std::size_t begin = points.size();
    const std::size_t end = begin + count / parts;
    double whole = 0;
    for (std::size_t i = first; i < first + old; ++i)
      whole += (chain.next_point(i) - chain.points[i]).length();
    const double step = whole / static_cast<double>(end - begin);
    const auto next = [&] { return static_cast<double>(points.size() - begin) * step; };
    double walked = 0;
    for (std::size_t i = first; i < first + old && points.size() < end; ++i) {
      const V3d a = chain.points[i];
      const V3d b = chain.next_point(i);
      const double length = (b - a).length();
      while (points.size() < end && next() <= walked + length) {
        const double part_of_way = (next() - walked) / std::max(length, 1e-300);
        points.push_back(a + (b - a) * std::clamp(part_of_way, 0.0, 1.0));
      }
      walked += length;
    }
    while (points.size() < end) points.push_back(chain.points[first + old - 1]);  // rounding at the very end
  }
  return points;
}

void diffuse_strains(std::span<Imath::M33d> strains, double spread, double recovery) {
  const std::vector<Imath::M33d> old(strains.begin(), strains.end());
  const std::size_t count = old.size();
  for (std::size_t i = 0; i < count; ++i)
    strains[i] =
        (old[i] * (1 - 2 * spread) + (old[(i + 1) % count] + old[(i + count - 1) % count]) * spread) *
        (1 - recovery);
}

double set_squeeze(Imath::M33d& strain, const V3d& along, V3d& squeeze) {
  const V3d axis = std::abs(along.z) < 0.9 ? V3d(0, 0, 1) : V3d(1, 0, 0);
  const V3d x = (axis - along * axis.dot(along)).normalized();
  const V3d y = along.cross(x);
  // In the plane of x and y it is (c, s; s, -c).
  const double c = 0.5 * (x.dot(x * strain) - y.dot(y * strain));
  const double s = x.dot(y * strain);
  const double size = std::sqrt(c * c + s * s);
  const double part = size > max_stretch ? max_stretch / size : 1;
  for (int k = 0; k < 3; ++k)
    for (int l = 0; l < 3; ++l)
      strain[k][l] = part * (c * (x[k] * x[l] - y[k] * y[l]) + s * (x[k] * y[l] + y[k] * x[l]));
  const double wide = exp_of(part * size);
  const V3d widest = c > 0 ? x * (size + c) + y * s : x * s + y * (size - c);
  squeeze = widest.normalized() * std::sqrt(1 - 1 / (wide * wide));
  return wide;
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

template <class Value>
void average_by_kind(std::span<const std::uint32_t> kind_of, std::span<const std::uint32_t> images,
                     std::vector<Value>& values) {
  std::vector<Value> sums(images.size(), Value(0.0));
  std::vector<int> counts(images.size(), 0);
  for (std::size_t i = 0; i < values.size(); ++i) {
    sums[kind_of[i]] += values[i];
    ++counts[kind_of[i]];
  }
  std::vector<Value> means = sums;
  for (std::size_t k = 0; k < means.size(); ++k) {
    int count = counts[k];
    if constexpr (std::is_same_v<Value, V3d>)
      if (const std::uint32_t image = images[k]; image != no_image) {
        means[k] += V3d(-sums[image].x, sums[image].y, sums[image].z);
        count += counts[image];
      }
    means[k] *= 1.0 / count;
  }
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = means[kind_of[i]];
}

template void average_by_kind(std::span<const std::uint32_t>, std::span<const std::uint32_t>,
                              std::vector<V3d>&);
template void average_by_kind(std::span<const std::uint32_t>, std::span<const std::uint32_t>,
                              std::vector<Imath::M33d>&);

}  // namespace selvedge
