#include "format/samples/outliers.h"

#include <fmt/format.h>

#include <algorithm>

namespace selvedge {
namespace {

/// Calls `visit(cell)` for the up to 8 cells around one.
template <class Visit>
void for_each_neighbour(const DirectionGrid& grid, int cell, const Visit& visit) {
  const int column = cell % grid.columns;
  const int row = cell / grid.columns;
  for (int r = std::max(0, row - 1); r <= std::min(grid.rows - 1, row + 1); ++r) {
    for (int c = std::max(0, column - 1); c <= std::min(grid.columns - 1, column + 1); ++c) {
      if (r != row || c != column) visit(r * grid.columns + c);
    }
  }
}

}  // namespace

void OutlierSearch::search_texel(const SampleLevel& rows, std::size_t texel) {
  const auto value = [&](int view, int light) {
    const std::size_t seen = texel * rows.views + view;
    return rows.radiance[seen * rows.lights + light] * rows.alpha[seen];
  };
  V3d sum(0, 0, 0);
  V3f largest(0, 0, 0);
  for (int view = 0; view < rows.views; ++view) {
    for (int light = 0; light < rows.lights; ++light) {
      const V3f sample = value(view, light);
      sum += V3d(sample);
      for (int c = 0; c < 3; ++c) largest[c] = std::max(largest[c], sample[c]);
    }
  }
  const double others = std::max(1, rows.views * rows.lights - 1);
  const auto mean_beside = [&](const V3f& sample) { return V3f((sum - V3d(sample)) / others); };
  // In the channel where it is largest.
  const auto ratio_to = [](const V3f& sample, const V3f& around) {
    float ratio = 0;
    for (int c = 0; c < 3; ++c) ratio = std::max(ratio, around[c] > 0 ? sample[c] / around[c] : 0);
    return ratio;
  };
  if (!(ratio_to(largest, mean_beside(largest)) > outlier_ratio)) return;
  for (int view = 0; view < rows.views; ++view) {
    for (int light = 0; light < rows.lights; ++light) {
      const V3f sample = value(view, light);
      V3f around = mean_beside(sample);
      if (!(ratio_to(sample, around) > outlier_ratio)) continue;
      const auto include = [&](int other_view, int other_light) {
        const V3f other = value(other_view, other_light);
        for (int c = 0; c < 3; ++c) around[c] = std::max(around[c], other[c]);
      };
      for_each_neighbour(views_, view, [&](int other) { include(other, light); });
      for_each_neighbour(lights_, light, [&](int other) { include(view, other); });
      const float ratio = ratio_to(sample, around);
      if (!(ratio > outlier_ratio)) continue;
      ++count_;
      if (ratio <= largest_ratio_) continue;
      largest_ratio_ = ratio;
      largest_ = {
          Code::samples_outlier,
          {},
          fmt::format("{}texel {},{}, view {}, light {}",
                      side_ == Side::front ? "" : fmt::format("{}, ", name_of(side_)), texel % rows.width,
                      next_row_ + static_cast<int>(texel) / rows.width, view, light),
          fmt::format("sample is {:.3g} times all around it", largest_ratio_)};
    }
  }
}

void OutlierSearch::add(const SampleLevel& rows) {
  // In coarser grids neighbours are far apart, and any of them may be dark.
  constexpr int min_directions = 16;
  if (std::min(views_.count(), lights_.count()) < min_directions) return;
  for (int texel = 0; texel < rows.texels(); ++texel) search_texel(rows, texel);
  next_row_ += rows.height;
}

Issues OutlierSearch::warnings() const {
  if (count_ == 0) return {};
  Error warning = largest_;
  warning.message += count_ > 1 ? fmt::format("; {} samples stand out, and fits follow them", count_)
                                : ", and fits follow it";
  return {warning};
}

}  // namespace selvedge
