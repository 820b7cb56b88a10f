// The march of a ray through the cells of Yarns: a cell's segments are tested in blocks.
#include <algorithm>
#include <cmath>
#include <limits>

#include "format/fabric/lifted.h"
#include "format/fabric/yarns.h"
#include "format/simd/wide_float.h"

namespace selvedge {
namespace {

/// Rays that have visited so many cells meet nothing more.
constexpr int max_cells_of_a_ray = 16384;
/// Light leaves the surface so many radii above it: more than a chain's corners stand out.
constexpr float leave_radii = 1.0F / 64;
/// Distance to what a ray does not meet.
constexpr float none = std::numeric_limits<float>::max();

}  // namespace

struct Yarns::Met {
  float distance = std::numeric_limits<float>::max();
  int segment = -1;
  V3f from_start{0, 0, 0};
};

namespace {

struct LocalRay {
  V3f origin;  ///< in the cell's frame
  V3f direction;
  float from = 0;  ///< entries before this distance do not count
  float to = 0;    ///< nor those beyond this one
};

/// The distances at which a ray enters the round segments, their sides and first ends, in `entries`; `none`
/// where it does not. The other end is the next segment's. `entered`: whether it enters any.
template <std::size_t N>
SELVEDGE_INLINE void enter_segments(const float* block, const LocalRay& ray, float* entries, bool& entered) {
  // GCC 12 takes comparisons of 16 numbers apart.
  constexpr std::size_t width = std::min(N, yarn_block);
  using Wide = WideFloat<width>;
  entered = false;
  for (std::size_t i = 0; i < yarn_block; i += width) {
    const auto lane = [&](std::size_t row) { return Wide::load(block + yarn_block * row + i); };
    const WideVec3<width> from{Wide(ray.origin.x) - lane(0), Wide(ray.origin.y) - lane(1),
                               Wide(ray.origin.z) - lane(2)};
    const WideVec3<width> axis{lane(3), lane(4), lane(5)};
    const WideVec3<width> d{Wide(ray.direction.x), Wide(ray.direction.y), Wide(ray.direction.z)};
    const Wide length = lane(6);
    const Wide r2 = lane(7) * lane(7);
    const Wide zero(0);
    const Wide nothing(none);
    const Wide start(ray.from);

    const Wide along = axis.dot(from);
    const Wide slope = axis.dot(d);
    const Wide back = d.dot(from);
    // The side: between the lines lie |gap| / |normal|.
    const WideVec3<width> normal = d.cross(axis);
    const Wide a = normal.dot(normal);
    const Wide gap = from.dot(normal);
    const Wide h = a * r2 - gap * gap;
    const Wide side = (along * slope - back - sqrt(max(h, zero))) / a;
    const Wide at = along + side * slope;
    Wide entry = if_greater(h, zero, side, nothing);
    entry = if_greater(at, zero, entry, nothing);
    entry = if_greater(length, at, entry, nothing);
    entry = if_greater(entry, start, entry, nothing);
    // The round end.
    const WideVec3<width> off = from.cross(d);
    const Wide g = r2 - off.dot(off);
    Wide end = if_greater(g, zero, -back - sqrt(max(g, zero)), nothing);
    end = if_greater(end, start, end, nothing);
    entry = min(entry, end);
    entry.store(entries + i);
    entered |= any_greater(Wide(ray.to), entry);
  }
}

SELVEDGE_THREE_BODIES(enter_segments,
                      (const float* block, const LocalRay& ray, float* entries, bool& entered),
                      (block, ray, entries, entered))

/// Depths of a point below the surfaces of round segments, as squares of radii: negative outside.
template <std::size_t N>
SELVEDGE_INLINE void depth_in_segments(const float* block, const LocalRay& ray, float* depths) {
  constexpr std::size_t width = std::min(N, yarn_block);
  using Wide = WideFloat<width>;
  for (std::size_t i = 0; i < yarn_block; i += width) {
    const auto lane = [&](std::size_t row) { return Wide::load(block + yarn_block * row + i); };
    const WideVec3<width> from{Wide(ray.origin.x) - lane(0), Wide(ray.origin.y) - lane(1),
                               Wide(ray.origin.z) - lane(2)};
    const WideVec3<width> axis{lane(3), lane(4), lane(5)};
    const WideVec3<width> off = from - axis * max(Wide(0), min(axis.dot(from), lane(6)));
    (lane(7) * lane(7) - off.dot(off)).store(depths + i);
  }
}

SELVEDGE_THREE_BODIES(depth_in_segments, (const float* block, const LocalRay& ray, float* depths),
                      (block, ray, depths))

/// Walks along one axis of the cells.
struct Axis {
  Axis(float origin, float direction, float size, int cells) : step(direction > 0 ? 1 : -1), count(cells) {
    cell = std::clamp(static_cast<int>(origin / size), 0, cells - 1);
    const float edge = static_cast<float>(cell + (direction > 0 ? 1 : 0)) * size;
    leaves = direction != 0 ? (edge - origin) / direction : none;
    each = direction != 0 ? size / std::abs(direction) : none;
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

float wrapped(double value, float period) {
  const double p = static_cast<double>(period);
  const auto result = static_cast<float>(value - std::floor(value / p) * p);
  return result < period ? result : 0;
}

}  // namespace

void Yarns::place_in_cells() {
  constexpr double max_cells = 1 << 20;
  double radius = 0;  // mean over the segments
  for (const Segment& s : segments_) radius += static_cast<double>(data_.curves[s.curve].radius);
  radius /= static_cast<double>(segments_.size());
  const V2d period(period_);
  const double size =
      std::max({radius, std::sqrt(period.x * period.y / max_cells), period.x / 4096, period.y / 4096});
  cells_ = {std::max(1, static_cast<int>(period.x / size)), std::max(1, static_cast<int>(period.y / size))};
  cell_size_ = {period_.x / static_cast<float>(cells_.x), period_.y / static_cast<float>(cells_.y)};
  const V2d cell(period.x / cells_.x, period.y / cells_.y);
  const double half_diagonal = 0.5 * cell.length() * 1.001;

  struct Copy {
    int segment;
    V2f shift;  // to be added to the segment's place
  };
  std::vector<std::vector<Copy>> lists(static_cast<std::size_t>(cells_.x) * cells_.y);
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    const Segment& s = segments_[i];
    const V2d a(s.start.x, s.start.y);
    const V2d along(s.along.x, s.along.y);
    const auto r = static_cast<double>(data_.curves[s.curve].radius);
    const V2d low = V2d(std::min(a.x, a.x + along.x), std::min(a.y, a.y + along.y)) - V2d(1.001 * r);
    const V2d high = V2d(std::max(a.x, a.x + along.x), std::max(a.y, a.y + along.y)) + V2d(1.001 * r);
    for (int y = static_cast<int>(std::floor(low.y / cell.y));
         y <= static_cast<int>(std::floor(high.y / cell.y)); ++y) {
      for (int x = static_cast<int>(std::floor(low.x / cell.x));
           x <= static_cast<int>(std::floor(high.x / cell.x)); ++x) {
        const V2d middle((x + 0.5) * cell.x, (y + 0.5) * cell.y);
        const double length2 = along.length2();
        const double share = length2 > 0 ? std::clamp((middle - a).dot(along) / length2, 0.0, 1.0) : 0;
        if ((middle - a - along * share).length() > 1.001 * r + half_diagonal) continue;
        const V2i repeat(static_cast<int>(std::floor(static_cast<double>(x) / cells_.x)),
                         static_cast<int>(std::floor(static_cast<double>(y) / cells_.y)));
        lists[static_cast<std::size_t>(y - repeat.y * cells_.y) * cells_.x + (x - repeat.x * cells_.x)]
            .push_back({static_cast<int>(i), V2f(-V2d(repeat.x * period.x, repeat.y * period.y))});
      }
    }
  }
  for (int y = 0; y < cells_.y; ++y) {
    for (int x = 0; x < cells_.x; ++x) {
      const auto& list = lists[static_cast<std::size_t>(y) * cells_.x + x];
      Cell placed{static_cast<std::uint32_t>(blocks_.size()), 0, none, -none};
      const V2d middle((x + 0.5) * cell.x, (y + 0.5) * cell.y);
      for (std::size_t i = 0; i < list.size(); ++i) {
        if (i % yarn_block == 0) blocks_.emplace_back(Block{});
        Block& block = blocks_.back();
        const Segment& s = segments_[list[i].segment];
        const float r = data_.curves[s.curve].radius;
        const V3f axis = s.along.normalized();
        const V3f start(static_cast<float>(static_cast<double>(s.start.x) +
                                           static_cast<double>(list[i].shift.x) - middle.x),
                        static_cast<float>(static_cast<double>(s.start.y) +
                                           static_cast<double>(list[i].shift.y) - middle.y),
                        s.start.z);
        for (int k = 0; k < 3; ++k) {
          block.start[k][i % yarn_block] = start[k];
          block.axis[k][i % yarn_block] = axis[k];
        }
        block.length[i % yarn_block] = s.along.length();
        block.radius[i % yarn_block] = r;
        block.segment[i % yarn_block] = list[i].segment;
        placed.low = std::min(placed.low, std::min(s.start.z, s.start.z + s.along.z) - r);
        placed.high = std::max(placed.high, std::max(s.start.z, s.start.z + s.along.z) + r);
      }
      placed.blocks = static_cast<std::uint32_t>(blocks_.size()) - placed.first;
      grid_.push_back(placed);
    }
  }
}

std::optional<Yarns::Met> Yarns::march(V3f origin, const V3f& direction, bool any) const {
  Axis x(origin.x, direction.x, cell_size_.x, cells_.x);
  Axis y(origin.y, direction.y, cell_size_.y, cells_.y);
  const float end = ((direction.z < 0 ? low_ : high_) - origin.z) / direction.z;
  float entered = 0;
  static const auto enter = enter_segments_for_this_processor();
  static const auto depth_in = depth_in_segments_for_this_processor();
  Met met;
  alignas(64) std::array<float, yarn_block> entries;
  for (int visited = 0; visited < max_cells_of_a_ray; ++visited) {
    const float left = std::min({x.next(), y.next(), end});
    const Cell& cell = grid_[static_cast<std::size_t>(y.cell) * cells_.x + x.cell];
    const float from = origin.z + direction.z * entered;
    const float to = origin.z + direction.z * left;
    if (cell.blocks > 0 && std::min(from, to) <= cell.high && std::max(from, to) >= cell.low) {
      const V3f middle((static_cast<float>(x.cell) + 0.5F) * cell_size_.x,
                       (static_cast<float>(y.cell) + 0.5F) * cell_size_.y, 0);
      LocalRay ray{origin + direction * entered - middle, direction, -entered, met.distance - entered};
      for (std::uint32_t b = cell.first; b < cell.first + cell.blocks; ++b) {
        const Block& block = blocks_[b];
        if (any && visited == 0) {
          depth_in(block.start[0].data(), ray, entries.data());
          if (*std::max_element(entries.begin(), entries.end()) > 0) return Met{};
        }
        bool enters = false;
        enter(block.start[0].data(), ray, entries.data(), enters);
        if (!enters) continue;
        if (any) return Met{};
        for (std::size_t i = 0; i < yarn_block; ++i) {
          if (!(entries[i] < ray.to)) continue;
          met.distance = entered + entries[i];
          met.segment = block.segment[i];
          met.from_start = ray.origin + direction * entries[i] -
                           V3f(block.start[0][i], block.start[1][i], block.start[2][i]);
          ray.to = entries[i];
        }
      }
    }
    if (met.segment >= 0 && met.distance <= left) return met;
    if (left >= end) break;
    entered = left;
    if (x.next() <= left) {
      if (x.advance()) origin.x -= static_cast<float>(x.step) * period_.x;
    } else {
      if (y.advance()) origin.y -= static_cast<float>(y.step) * period_.y;
    }
  }
  return met.segment >= 0 ? std::optional(met) : std::nullopt;
}

std::optional<YarnHit> Yarns::trace(const V2d& uv, float plane, const V3f& view) const {
  const V3f up = lifted(view);
  // From a little higher: a ray that begins on a yarn does not enter it.
  const float above = high_ + (high_ - low_) / 256;
  const double rise = (static_cast<double>(above) - static_cast<double>(plane)) / static_cast<double>(up.z);
  const V3f origin(
      wrapped(uv.x * static_cast<double>(period_.x) + rise * static_cast<double>(up.x), period_.x),
      wrapped(-uv.y * static_cast<double>(period_.y) + rise * static_cast<double>(up.y), period_.y), above);
  const auto met = march(origin, -up, false);
  if (!met) return std::nullopt;
  return YarnHit{met->segment, met->from_start};
}

bool Yarns::occluded(const YarnHit& hit, const YarnPoint& point, const V3f& light) const {
  const Segment& s = segments_[hit.segment];
  const V3f at = s.start + hit.from_start + point.normal * (leave_radii * data_.curves[s.curve].radius);
  return march({wrapped(static_cast<double>(at.x), period_.x), wrapped(static_cast<double>(at.y), period_.y),
                at.z},
               lifted(light), true)
      .has_value();
}

}  // namespace selvedge
