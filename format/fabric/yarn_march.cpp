// Rays against Yarns: sixteen at once, in packets of those that lie close enough together. Each segment that
// the walk finds (yarn_walk.h) is tested with all rays of a packet, one in each lane.
#include "format/fabric/lifted.h"
#include "format/fabric/yarn_walk.h"

namespace selvedge {
namespace {

/// Where rays come from; values of lanes that are not in `lanes` have no effect.
struct Rays {
  const YarnLanes& from;       ///< view rays: offsets from `uv`, in repeats; others: mm
  const YarnLanes& direction;  ///< towards the viewer or the light
  std::uint32_t lanes;
  const YarnWidths& widths;
  V2d uv{0, 0};
  float plane = 0;
};

/// Squares of a segment's radii for rays of these lanes: of its side, and of the ball about its start.
template <std::size_t N>
struct Radii {
  WideFloat<N> side2, ball2;
  SELVEDGE_INLINE Radii(const Yarns::Block& block, std::size_t k, const float* widths)
      : side2(block.radius[k] * block.radius[k]), ball2(block.reach[k] * block.reach[k]) {
    if (!(block.rank[k] > 0)) return;
    // A hair, which may stand for others.
    const WideFloat<N> own(block.radius[k]);
    const WideFloat<N> r =
        min(max(WideFloat<N>::load(widths) * WideFloat<N>(0.5F), own), WideFloat<N>(block.reach[k]));
    side2 = ball2 = if_greater(own, r * WideFloat<N>(block.rank[k]), r * r, WideFloat<N>(-1));
  }
};

float least_width(const YarnWidths& widths, std::uint32_t lanes) {
  float least = no_yarn;
  for (std::size_t i = 0; i < yarn_lanes; ++i)
    if ((lanes >> i & 1) != 0) least = std::min(least, widths[i]);
  return least;
}

/// The result of the kernels' bodies: the lanes that meet yarn, unless rays were too far apart.
struct Found {
  std::uint32_t lanes = 0;
  std::uint32_t too_wide = 0;  ///< if not 0: lanes that are close enough to the first
};

float wrapped(double value, float period) {
  const double p = static_cast<double>(period);
  const auto result = static_cast<float>(value - std::floor(value / p) * p);
  return result < period ? result : 0;
}

/// The largest of the lanes.
SELVEDGE_INLINE float largest(const YarnFloats& lanes) {
  using Wide = WideFloat<4>;
  Wide most = Wide::load(lanes.data());
  for (std::size_t i = 4; i < yarn_lanes; i += 4) most = max(most, Wide::load(&lanes[i]));
  std::array<float, 4> four;
  most.store(four.data());
  return std::max(std::max(four[0], four[1]), std::max(four[2], four[3]));
}

SELVEDGE_INLINE float least(const YarnFloats& lanes) {
  using Wide = WideFloat<4>;
  Wide low = Wide::load(lanes.data());
  for (std::size_t i = 4; i < yarn_lanes; i += 4) low = min(low, Wide::load(&lanes[i]));
  std::array<float, 4> four;
  low.store(four.data());
  return std::min(std::min(four[0], four[1]), std::min(four[2], four[3]));
}

/// `a` where the lane's bit is set, else `b`.
template <std::size_t N>
SELVEDGE_INLINE WideFloat<N> in_lanes(std::uint32_t lanes, std::size_t first, const WideFloat<N>& a,
                                      const WideFloat<N>& b) {
  return if_greater(lanes_of_bits<N>(lanes >> first), WideFloat<N>(0), a, b);
}

/// The squares of the distances of rays from a line in level planes, at their farthest; 0 in other lanes.
template <std::size_t N>
SELVEDGE_INLINE void find_beside(const YarnPacket& packet, std::uint32_t lanes, const V2f& from,
                                 const V2f& slope, YarnFloats& beside2) {
  constexpr std::size_t width = std::min(N, yarn_block);
  using Wide = WideFloat<width>;
  for (std::size_t i = 0; i < yarn_lanes; i += width) {
    const Wide x = Wide::load(&packet.x[i]) - Wide(from.x);
    const Wide y = Wide::load(&packet.y[i]) - Wide(from.y);
    const Wide end_x = x + (Wide::load(&packet.slope_x[i]) - Wide(slope.x)) * Wide(packet.height);
    const Wide end_y = y + (Wide::load(&packet.slope_y[i]) - Wide(slope.y)) * Wide(packet.height);
    in_lanes(lanes, i, max(x * x + y * y, end_x * end_x + end_y * end_y), Wide(0)).store(&beside2[i]);
  }
}

/// Finishes a packet of which x, y, slope_x, slope_y, start, rises and height are set, x and y being counted
/// from `base`. Returns 0 if it is narrow enough for the cells, else lanes that are close to the first.
template <std::size_t N>
SELVEDGE_INLINE std::uint32_t find_middle(const Yarns::Inside& yarns, const V2f& period, const V2d& base,
                                          float z, std::uint32_t lanes, YarnPacket& packet) {
  constexpr std::size_t width = std::min(N, yarn_block);
  using Wide = WideFloat<width>;
  const auto first = static_cast<std::size_t>(std::countr_zero(lanes));
  const auto last = static_cast<std::size_t>(std::bit_width(lanes)) - 1;
  const auto middle = [&](const YarnFloats& of) { return (of[first] + of[last]) / 2; };
  const V2f from(middle(packet.x), middle(packet.y));
  packet.slope = {middle(packet.slope_x), middle(packet.slope_y)};
  alignas(64) YarnFloats beside2;
  find_beside<N>(packet, lanes, from, packet.slope, beside2);
  packet.beside = std::sqrt(largest(beside2));
  if (packet.beside > yarns.beside && first != last) {
    // Rays that are 2/3 as close to the first are close enough to the line between any two of them.
    find_beside<N>(packet, lanes, {packet.x[first], packet.y[first]},
                   {packet.slope_x[first], packet.slope_y[first]}, beside2);
    std::uint32_t close = 1U << first;
    for (std::size_t i = first; i < yarn_lanes; ++i)
      close |= static_cast<std::uint32_t>(2.26F * beside2[i] < yarns.beside * yarns.beside) << i;
    return close & lanes;
  }
  packet.middle = {wrapped(base.x + static_cast<double>(from.x), period.x),
                   wrapped(base.y + static_cast<double>(from.y), period.y), z};
  for (std::size_t i = 0; i < yarn_lanes; i += width) {
    (Wide::load(&packet.x[i]) - Wide(from.x)).store(&packet.x[i]);
    (Wide::load(&packet.y[i]) - Wide(from.y)).store(&packet.y[i]);
  }
  return 0;
}

/// Ways along x and y by the height that rays along the lifted directions gain.
template <std::size_t N>
SELVEDGE_INLINE void find_slopes(const Rays& rays, float sign, YarnPacket& packet) {
  constexpr std::size_t width = std::min(N, yarn_block);
  using Wide = WideFloat<width>;
  for (std::size_t i = 0; i < yarn_lanes; i += width) {
    const Wide scale = Wide(sign) / max(Wide::load(&rays.direction.z[i]), Wide(min_rise));
    const Wide x = Wide::load(&rays.direction.x[i]) * scale;
    const Wide y = Wide::load(&rays.direction.y[i]) * scale;
    x.store(&packet.slope_x[i]);
    y.store(&packet.slope_y[i]);
    (Wide(1) / (x * x + y * y + Wide(1))).store(&packet.per_d2[i]);
  }
  packet.rises = sign;
}

template <std::size_t N>
SELVEDGE_INLINE void first_hits(const Yarns::Inside& yarns, const V2f& period, const Rays& rays,
                                YarnHits& hits, Found& found) {
  constexpr std::size_t width = std::min(N, yarn_block);
  using Wide = WideFloat<width>;
  using Vec = WideVec3<width>;
  YarnPacket packet;
  find_slopes<N>(rays, -1, packet);
  // From a little higher: a ray that begins on a yarn does not enter it.
  const float above = yarns.high + (yarns.high - yarns.low) / 256;
  const double rise = static_cast<double>(above) - static_cast<double>(rays.plane);
  const auto one = static_cast<std::size_t>(std::countr_zero(rays.lanes));
  const V2d repeats(static_cast<double>(period.x), -static_cast<double>(period.y));
  const V2d uv = rays.uv + V2d(rays.from.x[one], rays.from.y[one]);
  const V2d base = uv * repeats - V2d(packet.slope_x[one], packet.slope_y[one]) * rise;
  for (std::size_t i = 0; i < yarn_lanes; i += width) {
    const auto off = [&](const YarnFloats& from, const YarnFloats& slope, double repeat) {
      const Wide apart = Wide::load(&from[i]) - Wide(from[one]);
      return (apart - floor(apart + Wide(0.5F))) * Wide(static_cast<float>(repeat)) -
             (Wide::load(&slope[i]) - Wide(slope[one])) * Wide(static_cast<float>(rise));
    };
    off(rays.from.x, packet.slope_x, repeats.x).store(&packet.x[i]);
    off(rays.from.y, packet.slope_y, repeats.y).store(&packet.y[i]);
  }
  packet.height = above - yarns.low;
  packet.width = least_width(rays.widths, rays.lanes);
  found.too_wide = find_middle<N>(yarns, period, base, above, rays.lanes, packet);
  if (found.too_wide != 0) return;
  alignas(64) YarnFloats nearest;
  alignas(64) YarnFloats segment{};
  for (std::size_t i = 0; i < yarn_lanes; ++i) nearest[i] = (rays.lanes >> i & 1) != 0 ? no_yarn : -no_yarn;
  float far = no_yarn;
  const auto test = [&](const Yarns::Block& block, std::size_t k, const V3f& at, float entered) {
    const Vec axis{Wide(block.axis[0][k]), Wide(block.axis[1][k]), Wide(block.axis[2][k])};
    const V3f to_middle = at - V3f(block.start[0][k], block.start[1][k], block.start[2][k]);
    const Wide zero(0);
    const Wide nothing(no_yarn);
    const V2f squeeze(block.squeeze[0][k], block.squeeze[1][k]);
    const bool flat = squeeze != V2f(0, 0);
    bool nearer = false;
    for (std::size_t i = 0; i < yarn_lanes; i += width) {
      const Radii<width> radii(block, k, &rays.widths[i]);
      const Vec way{Wide::load(&packet.slope_x[i]), Wide::load(&packet.slope_y[i]), Wide(packet.rises)};
      const Vec beside{Wide::load(&packet.x[i]), Wide::load(&packet.y[i]), zero};
      const Vec d_beside{way.x - Wide(packet.slope.x), way.y - Wide(packet.slope.y), zero};
      const Vec begin =
          Vec{Wide(to_middle.x), Wide(to_middle.y), Wide(to_middle.z)} + (beside + d_beside * Wide(entered));
      Vec d = way;
      Vec from = begin;
      Wide per_d2 = Wide::load(&packet.per_d2[i]);
      if (flat) {
        d = squeezed_lanes(way, Wide(squeeze.x), Wide(squeeze.y));
        from = squeezed_lanes(begin, Wide(squeeze.x), Wide(squeeze.y));
        per_d2 = Wide(1) / d.dot(d);
      }
      const Wide along = axis.dot(from);
      const Wide slope = axis.dot(d);
      const Wide back = d.dot(from);
      const Wide start(-entered);
      // The side: between the lines lie |gap| / |normal|.
      const Vec normal = d.cross(axis);
      const Wide a = normal.dot(normal);
      const Wide gap = from.dot(normal);
      const Wide h = a * radii.side2 - gap * gap;
      const Wide side = (along * slope - back - sqrt(max(h, zero))) / a;
      const Wide where = along + side * slope;
      Wide entry = if_greater(h, zero, side, nothing);
      entry = if_greater(where, zero, entry, nothing);
      entry = if_greater(Wide(block.length[k]), where, entry, nothing);
      entry = if_greater(entry, start, entry, nothing);
      // The round end. The other end is the next segment's.
      const Vec off = from.cross(d);
      const Wide d2 = d.dot(d);
      const Wide g = d2 * radii.ball2 - off.dot(off);
      Wide end = if_greater(g, zero, (-back - sqrt(max(g, zero))) * per_d2, nothing);
      end = if_greater(end, start, end, nothing);
      entry = min(entry, end);
      const Wide before = Wide::load(&nearest[i]);
      // `no_yarn` stays what it is.
      const Wide distance = entry + Wide(entered);
      if (!any_greater(before, distance)) continue;
      nearer = true;
      const Vec off_start = begin + way * entry;
      const auto keep = [&](const Wide& value, float* to) {
        if_greater(before, distance, value, Wide::load(to)).store(to);
      };
      keep(distance, &nearest[i]);
      keep(off_start.x, &hits.from_start.x[i]);
      keep(off_start.y, &hits.from_start.y[i]);
      keep(off_start.z, &hits.from_start.z[i]);
      keep(Wide(static_cast<float>(block.segment[k])), &segment[i]);
    }
    if (nearer) far = largest(nearest);
  };
  walk_yarns<N>(yarns, period, packet, far, test, [] {});
  for (std::size_t i = 0; i < yarn_lanes; ++i) {
    if ((rays.lanes >> i & 1) == 0 || !(nearest[i] < no_yarn)) continue;
    hits.segment[i] = static_cast<std::int32_t>(segment[i]);
    found.lanes |= 1U << i;
  }
}
SELVEDGE_THREE_BODIES(first_hits,
                      (const Yarns::Inside& yarns, const V2f& period, const Rays& rays, YarnHits& hits,
                       Found& found),
                      (yarns, period, rays, hits, found))

/// The rays that come, from where they begin, nearer to a segment's line than its radius.
template <std::size_t N>
SELVEDGE_INLINE void hidden(const Yarns::Inside& yarns, const V2f& period, const Rays& rays, Found& found) {
  constexpr std::size_t width = std::min(N, yarn_block);
  using Wide = WideFloat<width>;
  YarnPacket packet;
  find_slopes<N>(rays, 1, packet);
  const auto one = static_cast<std::size_t>(std::countr_zero(rays.lanes));
  alignas(64) YarnFloats heights;  // downwards
  for (std::size_t i = 0; i < yarn_lanes; i += width)
    in_lanes(rays.lanes, i, -Wide::load(&rays.from.z[i]), Wide(-no_yarn)).store(&heights[i]);
  const float lowest = -largest(heights);
  const auto start_of = [&](std::size_t i) { return Wide::load(&rays.from.z[i]) - Wide(lowest); };
  for (std::size_t i = 0; i < yarn_lanes; i += width) {
    const Wide start = start_of(i);
    const auto off = [&](const YarnFloats& from, const YarnFloats& slope, float repeat) {
      const Wide apart = Wide::load(&from[i]) - Wide(from[one]);
      return apart - floor(apart * Wide(1 / repeat) + Wide(0.5F)) * Wide(repeat) -
             Wide::load(&slope[i]) * start;
    };
    off(rays.from.x, packet.slope_x, period.x).store(&packet.x[i]);
    off(rays.from.y, packet.slope_y, period.y).store(&packet.y[i]);
    start.store(&packet.start[i]);
  }
  packet.height = std::max(0.0F, yarns.high - lowest);
  packet.width = least_width(rays.widths, rays.lanes);
  found.too_wide =
      find_middle<N>(yarns, period, V2d(rays.from.x[one], rays.from.y[one]), lowest, rays.lanes, packet);
  if (found.too_wide != 0) return;
  float far = no_yarn;
  // How deep in yarn rays come, as squares; lanes without a ray count as hidden.
  alignas(64) YarnFloats depth;
  for (std::size_t i = 0; i < yarn_lanes; i += width)
    in_lanes(rays.lanes, i, Wide(-no_yarn), Wide(no_yarn)).store(&depth[i]);
  const auto test = [&](const Yarns::Block& block, std::size_t k, const V3f& at, float entered) {
    const WideVec3<N> axis{WideFloat<N>(block.axis[0][k]), WideFloat<N>(block.axis[1][k]),
                           WideFloat<N>(block.axis[2][k])};
    const V3f to_middle = at - V3f(block.start[0][k], block.start[1][k], block.start[2][k]);
    const WideFloat<N> zero(0);
    const WideFloat<N> length(block.length[k]);
    const V2f squeeze(block.squeeze[0][k], block.squeeze[1][k]);
    const bool flat = squeeze != V2f(0, 0);
    for (std::size_t i = 0; i < yarn_lanes; i += N) {
      WideVec3<N> d{WideFloat<N>::load(&packet.slope_x[i]), WideFloat<N>::load(&packet.slope_y[i]),
                    WideFloat<N>(packet.rises)};
      const WideFloat<N> start = WideFloat<N>::load(&packet.start[i]) - WideFloat<N>(entered);
      const WideVec3<N> beside{WideFloat<N>::load(&packet.x[i]), WideFloat<N>::load(&packet.y[i]), zero};
      const WideVec3<N> d_beside{d.x - WideFloat<N>(packet.slope.x), d.y - WideFloat<N>(packet.slope.y),
                                 zero};
      // From where the ray begins.
      WideVec3<N> from =
          WideVec3<N>{WideFloat<N>(to_middle.x), WideFloat<N>(to_middle.y), WideFloat<N>(to_middle.z)} +
          (beside + d_beside * WideFloat<N>(entered)) + d * start;
      WideFloat<N> per_d2 = WideFloat<N>::load(&packet.per_d2[i]);
      if (flat) {
        d = squeezed_lanes(d, WideFloat<N>(squeeze.x), WideFloat<N>(squeeze.y));
        from = squeezed_lanes(from, WideFloat<N>(squeeze.x), WideFloat<N>(squeeze.y));
        per_d2 = WideFloat<N>(1) / d.dot(d);
      }
      const WideFloat<N> along = axis.dot(from);
      const WideFloat<N> slope = axis.dot(d);
      const WideFloat<N> back = d.dot(from);
      const WideFloat<N> d2 = d.dot(d);
      const WideVec3<N> normal = d.cross(axis);
      // The nearest points of line and segment; then, of the part that belongs to the ray.
      const WideFloat<N> nearest = max(zero, min(length, (along * d2 - back * slope) / normal.dot(normal)));
      const WideFloat<N> way = max(zero, (nearest * slope - back) * per_d2);
      const WideFloat<N> place = max(zero, min(length, along + way * slope));
      const WideVec3<N> off = from + d * way - axis * place;
      const Radii<N> radii(block, k, &rays.widths[i]);
      max(radii.side2 - off.dot(off), WideFloat<N>::load(&depth[i])).store(&depth[i]);
    }
  };
  const auto tested = [&] {
    if (least(depth) > 0) far = -no_yarn;
  };
  walk_yarns<N>(yarns, period, packet, far, test, tested);
  for (std::size_t i = 0; i < yarn_lanes; i += width)
    found.lanes |= bits_where_greater(Wide::load(&depth[i]), Wide(0)) << i & rays.lanes;
}
SELVEDGE_THREE_BODIES(hidden, (const Yarns::Inside& yarns, const V2f& period, const Rays& rays, Found& found),
                      (yarns, period, rays, found))

/// The lanes in which find(rays, found) finds something, in packets that are narrow enough for the cells.
template <class Find>
std::uint32_t find_in_packets(Rays rays, const Find& find) {
  Found found;
  for (std::uint32_t left = rays.lanes; left != 0; left &= ~rays.lanes) {
    rays.lanes = left;
    for (find(rays, found); found.too_wide != 0; find(rays, found)) rays.lanes = found.too_wide;
  }
  return found.lanes;
}

}  // namespace

std::uint32_t Yarns::trace(const V2d& uv, const YarnLanes& beside, float plane, const YarnLanes& view,
                           std::uint32_t lanes, YarnHits& hits, const YarnWidths& widths) const {
  static const auto first = first_hits_for_this_processor();
  const Inside inside = this->inside();
  return find_in_packets({beside, view, lanes, widths, uv, plane},
                         [&](const Rays& rays, Found& found) { first(inside, period_, rays, hits, found); });
}

std::uint32_t Yarns::occluded(const YarnLanes& from, const YarnLanes& light, std::uint32_t lanes,
                              const YarnWidths& widths) const {
  static const auto find_hidden = hidden_for_this_processor();
  const Inside inside = this->inside();
  return find_in_packets({from, light, lanes, widths},
                         [&](const Rays& rays, Found& found) { find_hidden(inside, period_, rays, found); });
}

std::optional<YarnHit> Yarns::trace(const V2d& uv, float plane, const V3f& view) const {
  YarnLanes views;
  views.set(0, view);
  YarnHits hits;
  if (trace(uv, {}, plane, views, 1, hits) == 0) return std::nullopt;
  return YarnHit{hits.segment[0], hits.from_start.at(0)};
}

bool Yarns::occluded(const YarnHit& hit, const YarnPoint& point, const V3f& light) const {
  const Segment& s = segments_[hit.segment];
  YarnLanes from;
  from.set(0, s.start + hit.from_start + point.normal * (leave_radii * s.radius));
  YarnLanes lights;
  lights.set(0, light);
  return occluded(from, lights, 1) != 0;
}

}  // namespace selvedge
