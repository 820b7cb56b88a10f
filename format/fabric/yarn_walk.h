// The walk of rays through the cells of Yarns. Rays that lie close together walk together: one line in their
// middle passes the cells and finds the few segments that any of them can meet, which are those that the line
// meets when it counts as thick. To be included by code for the lanes (format/simd).
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "format/fabric/yarns.h"
#include "format/simd/wide_float.h"

namespace selvedge {

/// Rays that have visited so many cells meet nothing more.
inline constexpr int max_cells_of_a_ray = 16384;
/// Distance to what a ray does not meet.
inline constexpr float no_yarn = std::numeric_limits<float>::max();
/// The thick line counts as thicker by this share of a radius, and a cell as longer by this share of its
/// side, so that rounding hides no segment.
inline constexpr float yarn_slack = 1e-3F;

using YarnFloats = std::array<float, yarn_lanes>;

/// Rays by the height h that they have travelled from a common plane: they are at
/// middle + (x, y, 0) + h (slope_x, slope_y, rises).
struct YarnPacket {
  V3f middle{0, 0, 0};  ///< within the period
  V2f slope{0, 0};      ///< of the line in the middle
  float rises = 1;      ///< -1: the rays come from above
  float height = 0;     ///< to travel
  float beside = 0;     ///< no ray is further from the line in a level plane, mm
  float width = 0;      ///< the least of YarnWidths
  alignas(64) YarnFloats x, y, slope_x, slope_y;
  alignas(64) YarnFloats per_d2;  ///< 1 / |(slope_x, slope_y, rises)|^2
  alignas(64) YarnFloats start;   ///< of shadow rays: what one meets before has no effect
};

/// squeezed() of yarn_section.h.
template <std::size_t N>
SELVEDGE_INLINE WideVec3<N> squeezed_lanes(const WideVec3<N>& p, const WideFloat<N>& x,
                                           const WideFloat<N>& y) {
  const WideFloat<N> part = x * p.x + y * p.y;
  return {p.x - x * part, p.y - y * part, p.z};
}

/// The segments of a block, as bits, that a line through `from` meets if it is thick by `beside`: it enters
/// them within the range, at `entries`, and has not left them before `start`. What lies beside the line does
/// not lie further beside it in a round section.
template <std::size_t N, bool flat>
SELVEDGE_INLINE std::uint32_t near_segments(const Yarns::Block& block, const V3f& from_point,
                                            const V3f& direction, float beside, const V2f& entry_range,
                                            float start, float* entries) {
  // GCC 12 takes comparisons of 16 numbers apart.
  constexpr std::size_t width = std::min(N, yarn_block);
  using Wide = WideFloat<width>;
  using Vec = WideVec3<width>;
  const float length2 = direction.length2();
  Vec d{Wide(direction.x), Wide(direction.y), Wide(direction.z)};
  Wide d2(length2);
  Wide per_d2(1 / length2);
  Wide per_d(1 / std::sqrt(length2));
  const Wide zero(0);
  const Wide nothing(no_yarn);
  std::uint32_t found = 0;
  for (std::size_t i = 0; i < yarn_block; i += width) {
    const auto lane = [&](std::size_t row) {
      return Wide::load(block.start[0].data() + yarn_block * row + i);
    };
    Vec from{Wide(from_point.x) - lane(0), Wide(from_point.y) - lane(1), Wide(from_point.z) - lane(2)};
    if constexpr (flat) {
      const Wide x = Wide::load(&block.squeeze[0][i]);
      const Wide y = Wide::load(&block.squeeze[1][i]);
      from = squeezed_lanes(from, x, y);
      d = squeezed_lanes(Vec{Wide(direction.x), Wide(direction.y), Wide(direction.z)}, x, y);
      d2 = d.dot(d);
      per_d2 = Wide(1) / d2;
      per_d = sqrt(per_d2);
    }
    const Vec axis{lane(3), lane(4), lane(5)};
    const Wide length = lane(6);
    const Wide radius = lane(7);  // the largest
    const Wide r = radius * Wide(1 + yarn_slack) + Wide(beside);
    const Wide along = axis.dot(from);
    const Wide slope = axis.dot(d);
    const Wide back = d.dot(from);
    const Vec normal = d.cross(axis);
    const Wide a = normal.dot(normal);
    const Wide gap = from.dot(normal);
    const Wide h = a * (r * r) - gap * gap;
    const Wide side = (along * slope - back - sqrt(max(h, zero))) / a;
    const Wide at = along + side * slope;
    Wide entry = if_greater(h, zero, side, nothing);
    entry = if_greater(at, zero, entry, nothing);
    entry = if_greater(length, at, entry, nothing);
    const Vec off = from.cross(d);
    const Wide g = d2 * (r * r) - off.dot(off);
    entry = min(entry, if_greater(g, zero, (-back - sqrt(max(g, zero))) * per_d2, nothing));
    const Vec other_off = off + normal * length;
    const Wide other_back = back - slope * length;
    const Wide other_g = d2 * (r * r) - other_off.dot(other_off);
    entry = min(entry, if_greater(other_g, zero, (-other_back - sqrt(max(other_g, zero))) * per_d2, nothing));
    // Of those that are not there.
    entry = if_greater(radius, zero, entry, nothing);
    const Wide leaves = max(-back, -other_back) * per_d2 + r * per_d;
    entry = if_greater(leaves, Wide(start), entry, nothing);
    const Wide wanted = if_greater(entry, Wide(entry_range.x), entry, nothing);
    wanted.store(entries + i);
    found |= bits_where_greater(Wide(entry_range.y), wanted) << i;
  }
  return found;
}

/// Walks along one axis of the cells.
struct CellAxis {
  CellAxis(float origin, float direction, float size, int cells)
      : step(direction > 0 ? 1 : -1), count(cells) {
    cell = std::clamp(static_cast<int>(origin / size), 0, cells - 1);
    const float edge = static_cast<float>(cell + (direction > 0 ? 1 : 0)) * size;
    leaves = direction != 0 ? (edge - origin) / direction : no_yarn;
    each = direction != 0 ? size / std::abs(direction) : no_yarn;
  }
  /// Whether the ray comes into the next repeat.
  bool advance() {
    ++taken;
    cell += step;
    if (cell >= 0 && cell < count) return false;
    cell -= step * count;
    return true;
  }
  float next() const { return leaves + static_cast<float>(taken) * each; }
  int cell = 0;
  int step;
  int count;
  int taken = 0;
  float leaves = 0;
  float each = 0;
};

/// Calls test(block, index in the block, the packet's middle at height h in the block's frame, h) for every
/// segment that a ray of the packet can meet, in the order in which the middle meets them, cell by cell. Ends
/// when `far`, the height beyond which nothing counts, is reached; test() may lower it, and tested(), called
/// after some of them.
template <std::size_t N, class Test, class Tested>
SELVEDGE_INLINE void walk_yarns(const Yarns::Inside& yarns, const V2f& period, const YarnPacket& packet,
                                float& far, const Test& test, const Tested& tested) {
  CellAxis x(packet.middle.x, packet.slope.x, yarns.cell_size.x, yarns.cells.x);
  CellAxis y(packet.middle.y, packet.slope.y, yarns.cell_size.y, yarns.cells.y);
  const V3f direction(packet.slope.x, packet.slope.y, packet.rises);
  const float overlap = yarn_slack * std::min(x.each, y.each);
  const float beyond = packet.beside + yarn_slack * (yarns.high - yarns.low);
  V3f origin = packet.middle;
  float entered = 0;
  alignas(32) std::array<float, yarn_block> entries;
  for (int visited = 0; visited < max_cells_of_a_ray; ++visited) {
    const float left = std::min({x.next(), y.next(), packet.height});
    const Yarns::Cell& cell = yarns.grid[static_cast<std::size_t>(y.cell) * yarns.cells.x + x.cell];
    const float from = origin.z + direction.z * entered;
    const float to = origin.z + direction.z * left;
    if (cell.blocks > 0 && std::min(from, to) <= cell.high + beyond &&
        std::max(from, to) >= cell.low - beyond) {
      const V3f at = origin + direction * entered -
                     V3f((static_cast<float>(x.cell) + 0.5F) * yarns.cell_size.x,
                         (static_cast<float>(y.cell) + 0.5F) * yarns.cell_size.y, 0);
      const float first = visited == 0 ? -no_yarn : -overlap;
      for (std::uint32_t b = cell.first; b < cell.first + cell.blocks; ++b) {
        const Yarns::Block& block = yarns.blocks[b];
        const float reached = origin.z + direction.z * std::min(left, far);
        if (block.low > std::max(from, reached) + beyond || block.high < std::min(from, reached) - beyond ||
            packet.width >= block.empty_for)
          continue;
        const V2f range(first, std::min(left, far) - entered);
        std::uint32_t near = block.flat ? near_segments<N, true>(block, at, direction, packet.beside, range,
                                                                 -entered, entries.data())
                                        : near_segments<N, false>(block, at, direction, packet.beside, range,
                                                                  -entered, entries.data());
        const bool any = near != 0;
        while (near != 0) {
          auto k = static_cast<std::size_t>(std::countr_zero(near));
          for (std::uint32_t others = near & (near - 1); others != 0; others &= others - 1) {
            const auto other = static_cast<std::size_t>(std::countr_zero(others));
            if (entries[other] < entries[k]) k = other;
          }
          if (!(entries[k] < far - entered)) break;
          near &= ~(1U << k);
          test(block, k, at, entered);
        }
        if (any) tested();
      }
    }
    if (std::min(far, packet.height) <= left) return;
    entered = left;
    if (x.next() <= left) {
      if (x.advance()) origin.x -= static_cast<float>(x.step) * period.x;
    } else {
      if (y.advance()) origin.y -= static_cast<float>(y.step) * period.y;
    }
  }
}

}  // namespace selvedge
