// Rays against Yarns: a ray passes the cells one after another, with a map also cells of stitches around it,
// and meets or misses the segments of a block at once.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "format/fabric/lifted.h"
#include "format/fabric/yarns.h"
#include "format/simd/wide_float.h"

namespace selvedge {
namespace {

/// Maximum number of cells that a ray visits.
constexpr int max_cells_of_a_ray = 16384;
/// Distance to what a ray does not meet.
constexpr float no_yarn = std::numeric_limits<float>::max();
/// Segments count in a cell by this fraction of its side before it, so that rounding hides none.
constexpr float yarn_slack = 1e-3F;

/// A ray by the height that it has travelled.
struct Ray {
  V3f origin{0, 0, 0};     ///< within the period
  V3f direction{0, 0, 1};  ///< z: 1, or -1 for rays from above
  float height = 0;        ///< to travel
  float width = 0;         ///< of what it stands for, mm
};

struct Met {
  int segment = -1;
  float height = no_yarn;  ///< travelled
  V3f from_start{0, 0, 0};
};

float wrapped(double value, float period) {
  const double p = static_cast<double>(period);
  const auto result = static_cast<float>(value - std::floor(value / p) * p);
  return result < period ? result : 0;
}

/// A ray in the frames of N segments of a block, those from i on.
template <std::size_t N>
struct InRoundSections {
  using Wide = WideFloat<N>;
  using Vec = WideVec3<N>;
  SELVEDGE_INLINE InRoundSections(const Yarns::Block& block, std::size_t i, const V3f& at, const Ray& ray) {
    from = {Wide(at.x) - Wide::load(&block.start[0][i]), Wide(at.y) - Wide::load(&block.start[1][i]),
            Wide(at.z) - Wide::load(&block.start[2][i])};
    d = {Wide(ray.direction.x), Wide(ray.direction.y), Wide(ray.direction.z)};
    if (block.has_flat_segment) {
      const Vec squeeze{Wide::load(&block.squeeze[0][i]), Wide::load(&block.squeeze[1][i]),
                        Wide::load(&block.squeeze[2][i])};
      // As squeezed() of yarn_section.h.
      from = from - squeeze * squeeze.dot(from);
      d = d - squeeze * squeeze.dot(d);
    }
    const Vec axis{Wide::load(&block.axis[0][i]), Wide::load(&block.axis[1][i]),
                   Wide::load(&block.axis[2][i])};
    d2 = d.dot(d);
    along = axis.dot(from);
    slope = axis.dot(d);
    back = d.dot(from);
    normal = d.cross(axis);
    // Hairs may stand for others: then they are wider, and only a fraction of them is there.
    const Wide own = Wide::load(&block.radius[i]);
    const Wide rank = Wide::load(&block.hair_threshold[i]);
    const Wide reach = Wide::load(&block.bounding_radius[i]);
    const Wide wider = min(max(Wide(ray.width / 2), own), reach);
    const Wide of_hair = if_greater(own, wider * rank, wider * wider, Wide(-1));
    side2 = if_greater(rank, Wide(0), of_hair, own * own);
    ball2 = if_greater(rank, Wide(0), of_hair, reach * reach);
  }
  Vec from, d, normal;
  Wide d2, along, slope, back;
  Wide side2, ball2;  ///< squares of radii: of the side, and of the ball about the start
};

/// The nearest segment of a block that the ray enters within the range of heights from `at`; of shadow rays
/// any one that it meets in front of `at` or later.
template <std::size_t N>
SELVEDGE_INLINE void meet_block(const Yarns::Block& block, const V3f& at, const Ray& ray, bool shadow,
                                float entered, const V2f& range, Met& met) {
  constexpr std::size_t width = std::min(N, yarn_block_size);
  using Wide = WideFloat<width>;
  using Vec = WideVec3<width>;
  const Wide zero(0);
  const Wide nothing(no_yarn);
  for (std::size_t i = 0; i < yarn_block_size; i += width) {
    const InRoundSections<width> s(block, i, at, ray);
    const Wide length = Wide::load(&block.length[i]);
    const Wide start(-entered);
    if (shadow) {
      // The nearest points of line and segment; then, of the part that belongs to the ray.
      const Wide middle =
          max(zero, min(length, (s.along * s.d2 - s.back * s.slope) / s.normal.dot(s.normal)));
      const Wide way = max(start, (middle * s.slope - s.back) / s.d2);
      const Wide place = max(zero, min(length, s.along + way * s.slope));
      const Vec axis{Wide::load(&block.axis[0][i]), Wide::load(&block.axis[1][i]),
                     Wide::load(&block.axis[2][i])};
      const Vec off = s.from + s.d * way - axis * place;
      if (any_greater(s.side2, off.dot(off))) met.segment = block.segment[i];
      continue;
    }
    // The side: between the lines lie |gap| / |normal|.
    const Wide a = s.normal.dot(s.normal);
    const Wide gap = s.from.dot(s.normal);
    const Wide h = a * s.side2 - gap * gap;
    const Wide side = (s.along * s.slope - s.back - sqrt(max(h, zero))) / a;
    const Wide where = s.along + side * s.slope;
    Wide entry = if_greater(h, zero, side, nothing);
    entry = if_greater(where, zero, entry, nothing);
    entry = if_greater(length, where, entry, nothing);
    entry = if_greater(entry, start, entry, nothing);
    // The round end. The other end is the next segment's.
    const Vec off = s.from.cross(s.d);
    const Wide g = s.d2 * s.ball2 - off.dot(off);
    Wide end = if_greater(g, zero, (-s.back - sqrt(max(g, zero))) / s.d2, nothing);
    end = if_greater(end, start, end, nothing);
    entry = min(entry, end);
    entry = if_greater(entry, Wide(range.x), entry, nothing);
    if (!any_greater(Wide(range.y), entry)) continue;
    alignas(32) std::array<float, width> entries;
    entry.store(entries.data());
    for (std::size_t k = 0; k < width; ++k) {
      if (!(entries[k] < range.y && entries[k] + entered < met.height)) continue;
      met.segment = block.segment[i + k];
      met.height = entries[k] + entered;
      met.from_start = at + ray.direction * entries[k] -
                       V3f(block.start[0][i + k], block.start[1][i + k], block.start[2][i + k]);
    }
  }
}

/// Walks along one axis of the cells.
struct CellAxis {
  float origin, direction, size;
  int count;
  int step = direction > 0 ? 1 : -1;
  int cell = std::clamp(static_cast<int>(origin / size), 0, count - 1);
  int taken = 0;
  float edge = static_cast<float>(cell + (direction > 0 ? 1 : 0)) * size;
  float leaves = direction != 0 ? (edge - origin) / direction : no_yarn;
  float each = direction != 0 ? size / std::abs(direction) : no_yarn;
  /// Whether the ray comes into the next repeat.
  bool advance() {
    ++taken;
    cell += step;
    if (cell >= 0 && cell < count) return false;
    cell -= step * count;
    return true;
  }
  float next() const { return leaves + static_cast<float>(taken) * each; }
};

template <std::size_t N>
SELVEDGE_INLINE void walk(const Yarns::Grid& grid, const V2f& period, const YarnMap* map, const Ray& ray,
                          bool shadow, Met& met) {
  const V3f& direction = ray.direction;
  const V2i per_stitch = map != nullptr ? grid.count / map->kinds : grid.count;
  const V2i count = map != nullptr ? per_stitch * map->size : grid.count;
  CellAxis x{ray.origin.x, direction.x, grid.size.x, count.x};
  CellAxis y{ray.origin.y, direction.y, grid.size.y, count.y};
  // Ways, by layer, from the ray's cell to the one of the stitch that a map shows there.
  std::vector<std::ptrdiff_t> to_shown(map != nullptr ? grid.layers.size() : 0);
  V2i stitch(-1, -1);
  const float overlap = yarn_slack * std::min(x.each, y.each);
  const float beyond = yarn_slack * (grid.max_z - grid.min_z);
  const auto cells_of_layer = std::ptrdiff_t{1} * grid.count.x * grid.count.y;
  V3f origin = ray.origin;
  float entered = 0;
  for (int visited = 0; visited < max_cells_of_a_ray; ++visited) {
    const float left = std::min({x.next(), y.next(), ray.height});
    const float from = origin.z + direction.z * entered;
    const float to = origin.z + direction.z * left;
    const V2i passed = map != nullptr ? V2i(x.cell / per_stitch.x, y.cell / per_stitch.y) : stitch;
    if (passed != stitch) {
      stitch = passed;
      for (std::size_t layer = 0; layer < to_shown.size(); ++layer) {
        const V2i& away = grid.layers[layer];
        const V2i shown = YarnMap::within(map->shown_upwards(stitch + away) - away, map->kinds);
        const V2i way = (shown - stitch) * per_stitch;
        to_shown[layer] = std::ptrdiff_t{1} * way.y * grid.count.x + way.x;
      }
    }
    auto number = std::ptrdiff_t{1} * y.cell * grid.count.x + x.cell;
    for (std::size_t layer = 0; layer < grid.layers.size(); ++layer, number += cells_of_layer) {
      const Yarns::Cell& cell = grid.cells[number + (map != nullptr ? to_shown[layer] : 0)];
      if (cell.block_count == 0 || std::min(from, to) > cell.max_z + beyond ||
          std::max(from, to) < cell.min_z - beyond)
        continue;
      const V3f at = origin + direction * entered -
                     V3f((static_cast<float>(x.cell) + 0.5F) * grid.size.x,
                         (static_cast<float>(y.cell) + 0.5F) * grid.size.y, 0);
      const V2f range(visited == 0 ? -no_yarn : -overlap, left - entered);
      for (std::uint32_t b = cell.first_block; b < cell.first_block + cell.block_count; ++b) {
        const Yarns::Block& block = grid.blocks[b];
        if (block.min_z > std::max(from, to) + beyond || block.max_z < std::min(from, to) - beyond ||
            ray.width >= block.min_empty_width)
          continue;
        meet_block<N>(block, at, ray, shadow, entered, range, met);
        if (shadow && met.segment >= 0) return;
      }
    }
    if (std::min(met.height, ray.height) <= left) return;
    entered = left;
    if (x.next() <= left) {
      if (x.advance()) origin.x -= static_cast<float>(x.step) * period.x;
    } else {
      if (y.advance()) origin.y -= static_cast<float>(y.step) * period.y;
    }
  }
}
SELVEDGE_THREE_BODIES(walk,
                      (const Yarns::Grid& grid, const V2f& period, const YarnMap* map, const Ray& ray,
                       bool shadow, Met& met),
                      (grid, period, map, ray, shadow, met))

/// A ray through a point, mm, of any repeat; upwards or from above.
Ray ray_of(const V2d& through, float height, const V3f& direction, float sign, const V2f& period) {
  const float rise = std::max(direction.z, min_ray_rise);
  const V3f way(sign * direction.x / rise, sign * direction.y / rise, sign);
  return {{wrapped(through.x, period.x), wrapped(through.y, period.y), height}, way, 0, 0};
}

}  // namespace

std::optional<YarnHit> Yarns::trace(const V2d& uv, float plane, const V3f& view, float width) const {
  // From a little higher: a ray that begins on a yarn does not enter it.
  const Grid& cells = grid();
  const float above = cells.max_z + (cells.max_z - cells.min_z) / 256;
  const double rise = (static_cast<double>(above) - static_cast<double>(plane)) /
                      static_cast<double>(std::max(view.z, min_ray_rise));
  const V2d all(repeat());
  const V2d through =
      uv * V2d(all.x, -all.y) + V2d(static_cast<double>(view.x), static_cast<double>(view.y)) * rise;
  Ray ray = ray_of(through, above, view, -1, V2f(all));
  ray.height = above - cells.min_z;
  ray.width = width;
  Met met;
  walk_for_this_processor(cells, V2f(all), data_.map.empty() ? nullptr : &data_.map, ray, false, met);
  if (met.segment < 0) return std::nullopt;
  YarnHit hit{met.segment, met.from_start};
  const V2f stitch = period_ / V2f(data_.map.kinds);
  for (int axis = 0; axis < 2 && !data_.map.empty(); ++axis) {
    const float moved = ray.origin[axis] + ray.direction[axis] * met.height - met.from_start[axis] -
                        derived_->segments[met.segment].start[axis];
    hit.map_shift[axis] = std::round(moved / stitch[axis]) * stitch[axis];
  }
  return hit;
}

bool Yarns::is_occluded(const V3f& from, const V3f& light, const YarnMap* map) const {
  const V2f all = map != nullptr ? repeat() : period_;
  Ray ray = ray_of(V2d(V2f(from.x, from.y)), from.z, light, 1, all);
  const Grid& cells = grid();
  ray.height = std::max(0.0F, cells.max_z - from.z);
  Met met;
  walk_for_this_processor(cells, all, map, ray, true, met);
  return met.segment >= 0;
}

bool Yarns::is_occluded(const YarnHit& hit, const YarnPoint& point, const V3f& light) const {
  const Segment& s = derived_->segments[hit.segment];
  const V3f shift(hit.map_shift.x, hit.map_shift.y, 0);
  return is_occluded(s.start + hit.start_offset + point.normal * (surface_offset_radii * s.radius) + shift,
                     light, data_.map.empty() ? nullptr : &data_.map);
}

}  // namespace selvedge
