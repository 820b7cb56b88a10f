#include "format/fabric/slabs.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace selvedge {
namespace {

/// The walk of a ray along one axis of the cells, by the depth below the place where it enters the slabs.
class Walk {
 public:
  /// At the depth 0 the ray is at `start`, in cells; it goes `slope` cells per mm of depth.
  Walk(double start, double slope, int cells) : slope_(slope), cells_(cells) {
    // In [0, cells], rounding included; exact however far the start is.
    const double remainder = std::fmod(start, cells);
    const double repeated = remainder < 0 ? remainder + cells : remainder;
    cell_ = std::min(static_cast<int>(repeated), cells - 1);
    edge_ = slope > 0 ? cell_ + 1 - repeated : repeated - cell_;
  }
  int cell() const { return cell_; }
  /// The depth at which the ray leaves the cell.
  double leaves() const {
    return slope_ == 0 ? std::numeric_limits<double>::infinity() : (edge_ + steps_) / std::abs(slope_);
  }
  void step() {
    ++steps_;
    cell_ += slope_ > 0 ? 1 : -1;
    if (cell_ == cells_) cell_ = 0;
    if (cell_ < 0) cell_ = cells_ - 1;
  }

 private:
  double slope_;
  double edge_ = 0;  ///< cells from the start to the first edge
  double steps_ = 0;
  int cells_;
  int cell_ = 0;
};

}  // namespace

SlabMarch::SlabMarch(const FabricLevel& level, const FabricInfo& info)
    : level_(level), period_(info.period_mm), plane_(static_cast<double>(info.reference_height)) {}

V2i SlabMarch::cells() const {
  return {level_.width * level_.cells.columns, level_.height * level_.cells.rows};
}

V2d SlabMarch::cells_per_mm(const V3f& view) const {
  const double z = std::max(static_cast<double>(view.z), 1.0 / 32);
  // v grows downwards, against y.
  return {static_cast<double>(view.x) / (z * period_.x) * cells().x,
          -static_cast<double>(view.y) / (z * period_.y) * cells().y};
}

double SlabMarch::max_cells(const V3f& view) const {
  const double depth =
      static_cast<double>(level_.height_range().highest) - static_cast<double>(level_.height_range().lowest);
  if (!(depth > 0)) return 0;
  const V2d slope = cells_per_mm(view);
  // A ray crosses one edge more than it has whole cells of way, along either axis.
  return std::min(3 + depth * (std::abs(slope.x) + std::abs(slope.y)),
                  static_cast<double>(max_cells_of_a_ray));
}

std::optional<SlabHit> SlabMarch::operator()(const V2d& uv, const V3f& view) const {
  const auto highest_top = static_cast<double>(level_.height_range().highest);
  const double deepest = highest_top - static_cast<double>(level_.height_range().lowest);
  if (!(deepest > 0)) return std::nullopt;
  const SlabShape& shape = level_.cells;
  const std::span<const SlabEnds> ends = level_.heights();
  const V2i cells = this->cells();
  const V2d up = cells_per_mm(view);
  const double above = highest_top - plane_;
  Walk x(uv.x * cells.x + above * up.x, -up.x, cells.x);
  Walk y(uv.y * cells.y + above * up.y, -up.y, cells.y);
  const auto per_slab = static_cast<std::size_t>(shape.columns * shape.rows);
  double entered = 0;
  for (int visited = 0; visited < max_cells_of_a_ray; ++visited) {
    const double left = std::min({x.leaves(), y.leaves(), deepest});
    const double from = highest_top - entered;
    const double to = highest_top - left;
    const auto texel =
        static_cast<std::size_t>(y.cell() / shape.rows * level_.width + x.cell() / shape.columns);
    const auto cell =
        static_cast<std::size_t>(y.cell() % shape.rows * shape.columns + x.cell() % shape.columns);
    std::optional<SlabHit> hit;
    double highest = -std::numeric_limits<double>::infinity();
    for (std::size_t slab = 0; slab < static_cast<std::size_t>(shape.slabs); ++slab) {
      const std::size_t entry = slab * per_slab + cell;
      const std::size_t index = texel * static_cast<std::size_t>(shape.entries()) + entry;
      const auto top = static_cast<double>(ends[index].top);
      const auto bottom = static_cast<double>(ends[index].bottom);
      if (!(top > bottom) || to > top || from < bottom || std::min(top, from) <= highest) continue;
      highest = std::min(top, from);
      hit = SlabHit{texel, entry};
    }
    if (hit) return hit;
    if (left >= deepest) break;
    entered = left;
    if (x.leaves() <= left) {
      x.step();
    } else {
      y.step();
    }
  }
  return std::nullopt;
}

}  // namespace selvedge
