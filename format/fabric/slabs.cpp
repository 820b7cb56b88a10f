#include "format/fabric/slabs.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace selvedge {
namespace {

/// Traversal of the cells along one axis, by the depth (mm) of the ray below the highest top.
class CellWalk {
 public:
  /// The ray begins at `start`, in cells, and moves by `slope` cells per mm of depth.
  CellWalk(double start, double slope, int cells) : slope_(slope), cells_(cells) {
    // In [0, cells], including rounding errors; fmod is exact for any start.
    const double remainder = std::fmod(start, cells);
    const double repeated = remainder < 0 ? remainder + cells : remainder;
    cell_ = std::min(static_cast<int>(repeated), cells - 1);
    edge_ = slope > 0 ? cell_ + 1 - repeated : repeated - cell_;
  }
  int cell() const { return cell_; }
  /// The depth at which the ray leaves the cell.
  double exit_depth() const {
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
  // v and y have opposite directions.
  return {static_cast<double>(view.x) / (z * period_.x) * cells().x,
          -static_cast<double>(view.y) / (z * period_.y) * cells().y};
}

double SlabMarch::max_cells(const V3f& view) const {
  const double depth =
      static_cast<double>(level_.height_range().highest) - static_cast<double>(level_.height_range().lowest);
  if (!(depth > 0)) return 0;
  const V2d slope = cells_per_mm(view);
  // Along either axis a ray crosses at most one edge more than the whole cells of its length.
  return std::min(3 + depth * (std::abs(slope.x) + std::abs(slope.y)),
                  static_cast<double>(max_cells_per_ray));
}

std::optional<SlabHit> SlabMarch::operator()(const V2d& uv, const V3f& view) const {
  const auto highest_top = static_cast<double>(level_.height_range().highest);
  const double max_depth = highest_top - static_cast<double>(level_.height_range().lowest);
  if (!(max_depth > 0)) return std::nullopt;
  const SlabShape& shape = level_.cells;
  const std::span<const SlabEnds> ends = level_.heights();
  const V2i cells = this->cells();
  const V2d up = cells_per_mm(view);
  const double above = highest_top - plane_;
  CellWalk x(uv.x * cells.x + above * up.x, -up.x, cells.x);
  CellWalk y(uv.y * cells.y + above * up.y, -up.y, cells.y);
  const std::size_t cells_of_texel = shape.columns * shape.rows;
  const std::size_t slabs = shape.slabs;
  double entry_depth = 0;
  for (int visited = 0; visited < max_cells_per_ray; ++visited) {
    const double exit_depth = std::min({x.exit_depth(), y.exit_depth(), max_depth});
    const double entry_height = highest_top - entry_depth;
    const double exit_height = highest_top - exit_depth;
    const std::size_t texel = y.cell() / shape.rows * level_.width + x.cell() / shape.columns;
    const std::size_t cell = y.cell() % shape.rows * shape.columns + x.cell() % shape.columns;
    std::optional<SlabHit> hit;
    double highest = -std::numeric_limits<double>::infinity();
    for (std::size_t slab = 0; slab < slabs; ++slab) {
      const std::size_t entry = slab * cells_of_texel + cell;
      const std::size_t index = texel * slabs * cells_of_texel + entry;
      const auto top = static_cast<double>(ends[index].top);
      const auto bottom = static_cast<double>(ends[index].bottom);
      const double hit_height = std::min(top, entry_height);
      if (!(top > bottom) || exit_height > top || entry_height < bottom || hit_height <= highest) continue;
      highest = hit_height;
      hit = SlabHit{texel, entry};
    }
    if (hit) return hit;
    if (exit_depth >= max_depth) break;
    entry_depth = exit_depth;
    if (x.exit_depth() <= exit_depth) {
      x.step();
    } else {
      y.step();
    }
  }
  return std::nullopt;
}

}  // namespace selvedge
