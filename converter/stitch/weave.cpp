#include "converter/stitch/weave.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <utility>

namespace selvedge {
namespace {

/// Centres of adjacent lanes of these widths, followed by the total width.
std::vector<double> middles_of(const std::vector<double>& widths) {
  std::vector<double> middles;
  double sum = 0;
  for (const double width : widths) {
    middles.push_back(sum + 0.5 * width);
    sum += width;
  }
  middles.push_back(sum);
  return middles;
}

/// A chain through one point per crossing, horizontal there. `at(along, height_at)` makes points of the
/// cloth.
std::vector<BezierSegment> waving(const std::vector<double>& crossings,
                                  const std::function<double(std::size_t)>& height_at,
                                  const std::function<V3d(double, double)>& at) {
  const std::size_t count = crossings.size() - 1;
  const double period = crossings.back();
  std::vector<BezierSegment> chain;
  for (std::size_t k = 0; k < count; ++k) {
    const bool last = k + 1 == count;
    const double a = crossings[k];
    const double b = last ? crossings[0] + period : crossings[k + 1];
    const double height_a = height_at(k);
    const double height_b = height_at(last ? 0 : k + 1);
    const double third = (b - a) / 3;
    chain.push_back({at(a, height_a), at(a + third, height_a), at(b - third, height_b), at(b, height_b)});
  }
  return chain;
}

}  // namespace

StitchPattern draw_weave(const Weave& weave, const std::string& name) {
  const std::vector<double> x = middles_of(weave.warp_spacing_mm);
  const std::vector<double> y = middles_of(weave.weft_spacing_mm);
  StitchPattern pattern;
  pattern.name = name;
  pattern.period_mm = {x.back(), y.back()};
  // Waves of thin yarns: at a crossing each yields by the other's radius.
  constexpr double wave = 0.3;
  for (std::size_t i = 0; i < weave.warp.size(); ++i) {
    Yarn yarn = weave.warp[i];
    const auto height_at = [&](std::size_t j) {
      return wave * weave.weft[j].radius_mm * (weave.is_warp_over(i, j) ? 1 : -1);
    };
    yarn.segments = waving(y, height_at, [&](double along, double z) { return V3d(x[i], along, z); });
    pattern.yarns.push_back(std::move(yarn));
  }
  for (std::size_t j = 0; j < weave.weft.size(); ++j) {
    Yarn yarn = weave.weft[j];
    const auto height_at = [&](std::size_t i) {
      return wave * weave.warp[i].radius_mm * (weave.is_warp_over(i, j) ? -1 : 1);
    };
    yarn.segments = waving(x, height_at, [&](double along, double z) { return V3d(along, y[j], z); });
    pattern.yarns.push_back(std::move(yarn));
  }
  return pattern;
}

std::vector<std::vector<std::uint32_t>> crossing_kinds(const StitchPattern& weave) {
  const std::size_t rows = weave.yarns.front().segments.size();
  const std::size_t columns = weave.yarns.size() - rows;
  const auto width = [](const BezierSegment& segment) { return (segment[3] - segment[0]).dot(V3d(1, 1, 0)); };
  std::map<std::vector<double>, std::uint32_t> numbers;
  std::vector<std::vector<std::uint32_t>> kinds(weave.yarns.size());
  for (std::size_t i = 0; i < columns; ++i)
    for (std::size_t j = 0; j < rows; ++j) {
      for (const Yarn* yarn : {&weave.yarns[i], &weave.yarns[columns + j]})
        if (std::abs(width(yarn->segments[yarn == &weave.yarns[i] ? j : i]) / width(yarn->segments[0]) - 1) >
            1e-6)
          return {};
      std::vector<double> key;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t x = (i + columns + k - 1) % columns;
        const std::size_t y = (j + rows + k - 1) % rows;
        for (const Yarn* yarn : {&weave.yarns[x], &weave.yarns[columns + y]})
          key.insert(key.end(), {yarn->radius_mm, yarn->flattening, yarn->fibre_kind != 0 ? 1.0 : 0.0});
        for (const std::size_t above : {j + rows - 1, j, j + 1})
          key.push_back(weave.yarns[x].segments[above % rows][0].z > 0 ? 1 : 0);
      }
      const auto number = static_cast<std::uint32_t>(numbers.size());
      for (auto* of_yarn : {&kinds[i], &kinds[columns + j]})
        of_yarn->push_back(numbers.try_emplace(key, number).first->second);
    }
  return kinds;
}

Weave corner_of(const Weave& weave, std::size_t warps, std::size_t wefts) {
  Weave corner = weave;
  corner.warp.resize(std::min(warps, weave.warp.size()));
  corner.warp_spacing_mm.resize(corner.warp.size());
  corner.weft.resize(std::min(wefts, weave.weft.size()));
  corner.weft_spacing_mm.resize(corner.weft.size());
  corner.warp_is_over.clear();
  for (std::size_t j = 0; j < corner.weft.size(); ++j)
    for (std::size_t i = 0; i < corner.warp.size(); ++i)
      corner.warp_is_over.push_back(weave.is_warp_over(i, j));
  return corner;
}

}  // namespace selvedge
