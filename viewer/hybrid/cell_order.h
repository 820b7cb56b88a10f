// Sorts rays through yarn by their place in the fabric.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "format/fabric/yarns.h"

namespace selvedge {

/// An order of things that lie in the repeating cell: neighbours in it come after each other, things of one
/// depth first, so that their rays can be traced together.
class CellOrder {
 public:
  explicit CellOrder(const Yarns& yarns) : per_period_(1 / yarns.period().x, 1 / yarns.period().y) {
    // Rays that are traced together lie in about one cell.
    const V2i cells = yarns.inside().cells;
    columns_ = std::clamp(2 * cells.x, 1, most);
    rows_ = std::clamp(2 * cells.y, 1, most);
  }

  void clear() {
    items_.clear();
    slots_.clear();
  }
  /// `place` in mm, of any repeat; `depth` below the highest yarn, as a share of the cloth.
  void add(std::uint32_t item, const V2f& place, float depth) {
    const auto part = [](float at, int count) {
      const float share = at - static_cast<float>(static_cast<int>(at));
      return std::min(static_cast<int>((share < 0 ? share + 1 : share) * static_cast<float>(count)),
                      count - 1);
    };
    items_.push_back(item);
    const int layer = std::clamp(static_cast<int>(depth * layers), 0, layers - 1);
    const int row = part(place.y * per_period_.y, rows_);
    const int column = part(place.x * per_period_.x, columns_);
    slots_.push_back((layer * rows_ + row) * columns_ + (row % 2 == 0 ? column : columns_ - 1 - column));
  }
  std::span<const std::uint32_t> sorted() {
    starts_.assign(static_cast<std::size_t>(layers) * columns_ * rows_ + 1, 0);
    for (const int slot : slots_) ++starts_[slot + 1];
    for (std::size_t i = 1; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
    sorted_.resize(items_.size());
    for (std::size_t i = 0; i < items_.size(); ++i) sorted_[starts_[slots_[i]]++] = items_[i];
    return sorted_;
  }

 private:
  static constexpr int most = 64;
  static constexpr int layers = 4;
  V2f per_period_;
  int columns_;
  int rows_;
  std::vector<std::uint32_t> items_;
  std::vector<int> slots_;
  std::vector<std::uint32_t> starts_;
  std::vector<std::uint32_t> sorted_;
};

}  // namespace selvedge
