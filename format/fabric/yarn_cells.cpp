// The cells of Yarns: lists of the segments that rays can meet in each, in blocks for the lanes.
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "format/fabric/yarns.h"

namespace selvedge {
namespace {

struct CellSizes {
  V2i cells;
  V2d cell;  ///< mm
  double half_diagonal;
};

/// Cells are as large as the yarn is thick, in the mean over its segments but hairs; of large cloth larger.
CellSizes sizes_of(double radius, const V2f& period_mm, const YarnMap& map) {
  constexpr double max_cells = 1 << 16;
  const V2d period(period_mm);
  const double size =
      std::max({radius, std::sqrt(period.x * period.y / max_cells), period.x / 4096, period.y / 4096});
  const auto whole = [&](int axis) {
    // Whole numbers of them are a stitch of a map.
    const int stitches = map.kinds[axis];
    return (std::max(1, static_cast<int>(period[axis] / size)) + stitches - 1) / stitches * stitches;
  };
  const V2i cells{whole(0), whole(1)};
  const V2d cell(period.x / cells.x, period.y / cells.y);
  return {cells, cell, 0.5 * cell.length() * 1.001};
}

/// How far from its axis a segment reaches.
double reach_of(const Yarns::Segment& s) {
  return 1.001 * static_cast<double>(s.half_width(s.bounding_radius));
}

/// A segment in a cell, and what is added to its place there, mm.
struct Copy {
  int segment;
  V2f shift;
};

/// Calls add(x, y) for each cell, of any repeat, that the segment reaches.
template <class Add>
void for_each_cell(const Yarns::Segment& s, const CellSizes& sizes, const Add& add) {
  const V2d cell = sizes.cell;
  const V2d a(s.start.x, s.start.y);
  const V2d along(s.along.x, s.along.y);
  const double reach = reach_of(s);
  const V2d low = V2d(std::min(a.x, a.x + along.x), std::min(a.y, a.y + along.y)) - V2d(reach);
  const V2d high = V2d(std::max(a.x, a.x + along.x), std::max(a.y, a.y + along.y)) + V2d(reach);
  for (int y = static_cast<int>(std::floor(low.y / cell.y));
       y <= static_cast<int>(std::floor(high.y / cell.y)); ++y) {
    // A long segment that lies aslant: the part near the row.
    const double before = (y + 0.5) * cell.y - a.y - reach - sizes.half_diagonal;
    const double behind = (y + 0.5) * cell.y - a.y + reach + sizes.half_diagonal;
    const auto fraction_at = [&](double dy) { return std::clamp(dy / along.y, 0.0, 1.0); };
    const double from = along.y != 0 ? a.x + along.x * fraction_at(before) : low.x;
    const double to = along.y != 0 ? a.x + along.x * fraction_at(behind) : high.x;
    const double margin = reach + sizes.half_diagonal + cell.x;
    const double left = std::max(low.x, std::min(from, to) - margin);
    const double right = std::min(high.x, std::max(from, to) + margin);
    for (int x = static_cast<int>(std::floor(left / cell.x));
         x <= static_cast<int>(std::floor(right / cell.x)); ++x) {
      const V2d middle((x + 0.5) * cell.x, (y + 0.5) * cell.y);
      const double length2 = along.length2();
      const double fraction = length2 > 0 ? std::clamp((middle - a).dot(along) / length2, 0.0, 1.0) : 0;
      if ((middle - a - along * fraction).length() <= reach + sizes.half_diagonal) add(x, y);
    }
  }
}

/// Writes the segment into one lane of a block of the cell around `middle`.
void put(const Yarns::Segment& s, const Copy& copy, const V2d& middle, std::size_t lane,
         Yarns::Block& block) {
  const V3f along = squeezed(s.along, s.squeeze);
  const V3f axis = along.normalized();
  const V3f start(
      static_cast<float>(static_cast<double>(s.start.x) + static_cast<double>(copy.shift.x) - middle.x),
      static_cast<float>(static_cast<double>(s.start.y) + static_cast<double>(copy.shift.y) - middle.y),
      s.start.z);
  for (int k = 0; k < 3; ++k) {
    block.start[k][lane] = start[k];
    block.axis[k][lane] = axis[k];
    block.squeeze[k][lane] = s.squeeze[k];
  }
  block.length[lane] = along.length();
  block.bounding_radius[lane] = s.bounding_radius;
  block.radius[lane] = s.radius;
  block.hair_threshold[lane] = s.hair_threshold;
  block.segment[lane] = copy.segment;
  block.min_empty_width = std::max(block.min_empty_width, min_empty_width(s));
  block.has_flat_segment |= s.squeeze != V3f(0, 0, 0);
  block.min_z = std::min(block.min_z, std::min(s.start.z, s.start.z + s.along.z) - s.half_height());
  block.max_z = std::max(block.max_z, std::max(s.start.z, s.start.z + s.along.z) + s.half_height());
}

}  // namespace

double yarn_memory_bytes(const YarnData& data, const V2f& period) {
  constexpr double bytes_per_node = 512;
  constexpr double bytes_per_cell = 512;   // with a block that is not full
  constexpr double bytes_per_layer = 64;   // and cell
  constexpr double bytes_per_entry = 256;  // with the time that sorting takes: 16 million in 4 GiB
  double count = 0;
  double hairs = 0;
  double radius = 0;
  for (const YarnCurve& c : data.curves) {
    count += static_cast<double>(segment_count(c));
    hairs += static_cast<double>(std::abs(c.hairs.count)) * (hair_point_count - 1);
    radius += static_cast<double>(segment_count(c)) * static_cast<double>(ply_or_yarn_radius(c));
  }
  radius /= count;
  const CellSizes sizes = sizes_of(radius, period, data.map);
  const V2d stitch = V2d(period) / V2d(data.map.kinds);
  double entries = 0;
  V2d beyond(0, 0);  // stitches of a map that segments reach beyond their own
  std::vector<Yarns::Segment> segments;
  std::vector<V2i> stitches;
  for_each_curve(data, [&](std::size_t c, const YarnCurve& curve, std::span<const V3f> nodes) {
    segments.clear();
    stitches.clear();
    append_segments_with_hairs(curve, nodes, period, segments);
    if (!data.map.empty()) append_stitches(data, c, nodes, period, segments, stitches);
    for (std::size_t i = 0; i < segments.size(); ++i) {
      const Yarns::Segment& s = segments[i];
      const double around = reach_of(s) + 2 * sizes.half_diagonal;
      // The cells whose middles are near enough lie within these bounds about the segment.
      const double area = around * (2 * V2d(s.along.x, s.along.y).length() + std::numbers::pi * around);
      entries += area / (sizes.cell.x * sizes.cell.y);
      for (int axis = 0; axis < 2 && !stitches.empty(); ++axis) {
        const double middle = static_cast<double>(s.start[axis] + s.along[axis] / 2) / stitch[axis];
        const double reach = (static_cast<double>(std::abs(s.along[axis])) / 2 + reach_of(s)) / stitch[axis];
        beyond[axis] =
            std::max(beyond[axis], std::ceil(std::abs(middle - stitches[i][axis] - 0.5) + reach - 0.5));
      }
    }
  });
  const double layers = (1 + 2 * beyond.x) * (1 + 2 * beyond.y);
  return bytes_per_node * (count + hairs) +
         (bytes_per_cell + bytes_per_layer * (layers - 1)) * sizes.cells.x * sizes.cells.y +
         bytes_per_entry * entries;
}

Yarns::Grid Yarns::placed_in_cells() const {
  const Geometry all = geometry();
  double radius = 0;  // mean over the segments but hairs
  double count = 0;
  for (const Segment& s : all.segments) {
    if (s.hair_threshold > 0) continue;
    // As yarn_memory_bytes() has it: of flat yarn, the radius of a round one with the same area.
    radius += std::sqrt(static_cast<double>(s.radius) * static_cast<double>(s.half_width(s.radius)));
    ++count;
  }
  radius /= count;
  const CellSizes sizes = sizes_of(radius, period_, data_.map);
  const V2d period(period_);
  const V2i& cells = sizes.cells;
  Grid grid{all.min_z, all.max_z, cells, period_ / V2f(cells), {}, {}, {}};

  // By the ways from the cells' stitches of a map to the segments'.
  std::map<std::pair<int, int>, std::vector<std::vector<Copy>>> layers;
  for (std::size_t i = 0; i < all.segments.size(); ++i) {
    for_each_cell(all.segments[i], sizes, [&](int x, int y) {
      const V2i& kinds = data_.map.kinds;
      const V2i cell = YarnMap::within({x, y}, cells);
      const V2i repeat = (V2i(x, y) - cell) / cells;
      const V2i stitch = repeat * kinds + cell / (cells / kinds);
      const V2i away = all.stitches.empty() ? V2i(0, 0) : all.stitches[i] - stitch;
      auto& lists = layers[{away.x, away.y}];
      lists.resize(std::size_t{1} * cells.x * cells.y);
      lists[std::size_t{1} * cell.y * cells.x + cell.x].push_back(
          {static_cast<int>(i), V2f(-V2d(repeat.x * period.x, repeat.y * period.y))});
    });
  }
  std::size_t blocks = 0;
  for (const auto& [away, lists] : layers)
    for (const auto& list : lists) blocks += (list.size() + yarn_block_size - 1) / yarn_block_size;
  grid.blocks.reserve(blocks);
  grid.cells.reserve(layers.size() * cells.x * cells.y);
  for (auto& [away, lists] : layers) {
    grid.layers.emplace_back(away.first, away.second);
    for (std::size_t k = 0; k < lists.size(); ++k) {
      auto& list = lists[k];
      // Blocks of a few heights each, the highest first, and of hairs that vanish together: rays pass many of
      // them by.
      std::ranges::stable_sort(list, {}, [&](const Copy& c) {
        const Segment& s = all.segments[c.segment];
        return std::pair(s.hair_threshold > 0 ? std::max(-3, std::ilogb(s.hair_threshold)) : -4,
                         -2 * s.start.z - s.along.z);
      });
      Cell placed{static_cast<std::uint32_t>(grid.blocks.size())};
      const std::size_t row = k / cells.x;
      const V2d middle((static_cast<double>(k % cells.x) + 0.5) * sizes.cell.x,
                       (static_cast<double>(row) + 0.5) * sizes.cell.y);
      for (std::size_t i = 0; i < list.size(); ++i) {
        Block& block = i % yarn_block_size == 0 ? grid.blocks.emplace_back() : grid.blocks.back();
        put(all.segments[list[i].segment], list[i], middle, i % yarn_block_size, block);
        placed.min_z = std::min(placed.min_z, block.min_z);
        placed.max_z = std::max(placed.max_z, block.max_z);
      }
      placed.block_count = static_cast<std::uint32_t>(grid.blocks.size()) - placed.first_block;
      grid.cells.push_back(placed);
    }
  }
  return grid;
}

}  // namespace selvedge
