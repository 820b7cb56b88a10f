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

void OutlierSearch::search_texel(const SampleLevel& rows, std::size_t texel, int channel) {
  const auto value = [&](int view, int light) {
    const std::size_t seen = texel * rows.views + view;
    return rows.alpha[seen] * rows.radiance[seen * rows.lights + light][channel];
  };
  double sum = 0;
  float largest = 0;
  for (int view = 0; view < rows.views; ++view) {
    for (int light = 0; light < rows.lights; ++light) {
      sum += static_cast<double>(value(view, light));
      largest = std::max(largest, value(view, light));
    }
  }
  const int pairs = rows.views * rows.lights;
  const auto mean_of_others = [&](float sample) {
    return static_cast<float>((sum - static_cast<double>(sample)) / std::max(1, pairs - 1));
  };
  if (!(largest > outlier_ratio * mean_of_others(largest))) return;
  for (int view = 0; view < rows.views; ++view) {
    for (int light = 0; light < rows.lights; ++light) {
      const float sample = value(view, light);
      float around = mean_of_others(sample);
      if (!(sample > outlier_ratio * around)) continue;
      for_each_neighbour(views_, view, [&](int other) { around = std::max(around, value(other, light)); });
      for_each_neighbour(lights_, light, [&](int other) { around = std::max(around, value(view, other)); });
      if (!(around > 0 && sample > outlier_ratio * around)) continue;
      ++count_;
      if (sample <= largest_ratio_ * around) continue;
      largest_ratio_ = sample / around;
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
  for (int texel = 0; texel < rows.texels(); ++texel) {
    for (int channel = 0; channel < 3; ++channel) search_texel(rows, texel, channel);
  }
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
