#include "viewer/hybrid/index_pass.h"

#include <algorithm>
#include <cmath>

#include "format/scene/footprint.h"
#include "viewer/hybrid/fetch.h"

namespace selvedge {
namespace {

/// Inputs for the choice of texels, per pixel.
struct Footprints {
  alignas(64) LaneFloats u;  ///< in [0, 1]
  alignas(64) LaneFloats v;
  alignas(64) LaneFloats lower;   ///< the finer of the two levels
  alignas(64) LaneFloats upper;   ///< the coarser
  alignas(64) LaneFloats weight;  ///< of the coarser
  alignas(64) LaneFloats taps;    ///< number of taps along the footprint
  alignas(64) LaneFloats axis_u;  ///< in texture coordinates
  alignas(64) LaneFloats axis_v;
};

/// Data of the pixels' triangles.
struct Corners {
  std::array<std::array<const Group*, lane_count>, 3> screen;
  std::array<std::array<const Group*, lane_count>, 3> attributes;
  alignas(64) LaneFloats width;  ///< of level 0 of the whole fabric
  alignas(64) LaneFloats height;
  alignas(64) LaneFloats first_level;  ///< first level that is present; others count from it
  alignas(64) LaneFloats last_level;
  alignas(64) LaneFloats counts;  ///< weight of texels: 1 if the pixel shows a fabric, else 0
  alignas(64) LaneFloats yarn;    ///< 1 if the fabric has yarn, else 0
};

/// A value at the three corners, interpolated.
template <std::size_t N>
struct Interpolation {
  WideFloat<N> l1, l2;              ///< barycentric coordinates of corners 1 and 2
  WideFloat<N> l1_right, l2_right;  ///< their change per pixel to the right
  WideFloat<N> l1_up, l2_up;
  SELVEDGE_INLINE WideFloat<N> at(const WideFloat<N>& a, const WideFloat<N>& b, const WideFloat<N>& c) const {
    return a + l1 * (b - a) + l2 * (c - a);
  }
};

/// Homogeneous coordinates: correct in perspective and for corners behind the viewer (after Olano and Greer
/// 1997).
template <std::size_t N>
SELVEDGE_INLINE Interpolation<N> interpolation(const Corners& corners, const PixelBlock& block,
                                               std::size_t first) {
  using Wide = WideFloat<N>;
  const Wide x = Wide::load(&block.from_middle_x[first]);
  const Wide y = Wide::load(&block.from_middle_y[first]);
  Wide a[3];  // NOLINT(modernize-avoid-c-arrays): corners relative to the pixel, times their w
  Wide b[3];  // NOLINT(modernize-avoid-c-arrays)
  Wide w[3];  // NOLINT(modernize-avoid-c-arrays)
  for (std::size_t k = 0; k < 3; ++k) {
    Wide group[4];  // NOLINT(modernize-avoid-c-arrays)
    fetch<N>(corners.screen[k].data() + first, 0, group);
    a[k] = group[0] - x * group[2];
    b[k] = group[1] - y * group[2];
    w[k] = group[2];
  }
  const Wide e0 = a[1] * b[2] - a[2] * b[1];
  const Wide e1 = a[2] * b[0] - a[0] * b[2];
  const Wide e2 = a[0] * b[1] - a[1] * b[0];
  const Wide sum = e0 + e1 + e2;
  const Wide scale = if_greater(abs(sum), Wide(0), Wide(1) / sum, Wide(0));
  Interpolation<N> result;
  result.l1 = e1 * scale;
  result.l2 = e2 * scale;
  // d a_k / dx = -w_k, d b_k / dy = -w_k.
  const Wide e0_right = w[2] * b[1] - w[1] * b[2];
  const Wide e1_right = w[0] * b[2] - w[2] * b[0];
  const Wide e2_right = w[1] * b[0] - w[0] * b[1];
  const Wide e0_up = a[2] * w[1] - a[1] * w[2];
  const Wide e1_up = a[0] * w[2] - a[2] * w[0];
  const Wide e2_up = a[1] * w[0] - a[0] * w[1];
  const Wide sum_right = e0_right + e1_right + e2_right;
  const Wide sum_up = e0_up + e1_up + e2_up;
  result.l1_right = (e1_right - result.l1 * sum_right) * scale;
  result.l2_right = (e2_right - result.l2 * sum_right) * scale;
  result.l1_up = (e1_up - result.l1 * sum_up) * scale;
  result.l2_up = (e2_up - result.l2 * sum_up) * scale;
  return result;
}

/// Interpolates a texture coordinate without whole repeats of the first corner; also its change per pixel.
template <std::size_t N>
struct Coordinate {
  WideFloat<N> value, right, up;
};

template <std::size_t N>
SELVEDGE_INLINE Coordinate<N> coordinate(const Interpolation<N>& at, const WideFloat<N>* corner) {
  using Wide = WideFloat<N>;
  const Wide one = corner[1] - corner[0];
  const Wide two = corner[2] - corner[0];
  // This subtraction is exact.
  const Wide start = corner[0] - floor(corner[0]);
  return {start + (at.l1 * one + at.l2 * two), at.l1_right * one + at.l2_right * two,
          at.l1_up * one + at.l2_up * two};
}

/// A level's size follows from that of the whole fabric's level 0 (level_size()).
template <std::size_t N>
SELVEDGE_INLINE WideFloat<N> size_of_level(const WideFloat<N>& size0, const WideFloat<N>& scale) {
  return max(floor(size0 * scale), WideFloat<N>(1));
}

/// The texel, of `size`, at the repeating coordinate c; the first for NaN.
template <std::size_t N>
SELVEDGE_INLINE WideFloat<N> wrap(const WideFloat<N>& c, const WideFloat<N>& size) {
  using Wide = WideFloat<N>;
  return max(min(floor((c - floor(c)) * size), size - Wide(1)), Wide(0));
}

template <std::size_t N>
SELVEDGE_INLINE void interpolate_lanes(const Corners& corners, const LevelOptions& options, PixelBlock& block,
                                       Footprints& footprints) {
  using Wide = WideFloat<N>;
  for (std::size_t first = 0; first < lane_count; first += N) {
    const Interpolation<N> at = interpolation<N>(corners, block, first);
    at.l1.store(&block.second_corner[first]);
    at.l2.store(&block.third_corner[first]);
    Wide normal_u[3][4];   // NOLINT(modernize-avoid-c-arrays)
    Wide tangent_v[3][4];  // NOLINT(modernize-avoid-c-arrays)
    for (std::size_t k = 0; k < 3; ++k) {
      fetch<N>(corners.attributes[k].data() + first, 0, normal_u[k]);
      fetch<N>(corners.attributes[k].data() + first, 1, tangent_v[k]);
    }
    const auto along = [&](const Wide(&corner)[3][4], std::size_t i) __attribute__((always_inline)) {
      return at.at(corner[0][i], corner[1][i], corner[2][i]);
    };
    along(normal_u, 0).store(&block.normal.x[first]);
    along(normal_u, 1).store(&block.normal.y[first]);
    along(normal_u, 2).store(&block.normal.z[first]);
    along(tangent_v, 0).store(&block.tangent.x[first]);
    along(tangent_v, 1).store(&block.tangent.y[first]);
    along(tangent_v, 2).store(&block.tangent.z[first]);
    const Wide us[3] = {normal_u[0][3], normal_u[1][3], normal_u[2][3]};  // NOLINT(modernize-avoid-c-arrays)
    const Wide vs[3] = {tangent_v[0][3], tangent_v[1][3],
                        tangent_v[2][3]};  // NOLINT(modernize-avoid-c-arrays)
    const Coordinate<N> u = coordinate<N>(at, us);
    const Coordinate<N> v = coordinate<N>(at, vs);
    const Wide width = Wide::load(&corners.width[first]);
    const Wide height = Wide::load(&corners.height[first]);
    const Footprint<Wide> texel_footprint = footprint<Wide>(
        {u.right * width, v.right * height, u.up * width, v.up * height}, static_cast<float>(options.taps));
    // 0 where coordinates overflow.
    const Wide in_u = max(u.value - floor(u.value), Wide(0));
    const Wide in_v = max(v.value - floor(v.value), Wide(0));
    in_u.store(&footprints.u[first]);
    in_v.store(&footprints.v[first]);
    in_u.store(&block.u[first]);
    in_v.store(&block.v[first]);
    u.right.store(&block.u_right[first]);
    v.right.store(&block.v_right[first]);
    u.up.store(&block.u_up[first]);
    v.up.store(&block.v_up[first]);
    const Wide first_level = Wide::load(&corners.first_level[first]);
    const Wide relative = (options.forced >= 0 ? Wide(static_cast<float>(options.forced))
                                               : texel_footprint.level + Wide(options.bias)) -
                          first_level;
    const Wide finer = min(max(-relative, Wide(0)), Wide(1));
    (Wide::load(&corners.yarn[first]) * (options.blend ? finer : floor(finer + Wide(0.5F))))
        .store(&block.yarn[first]);
    const Wide last = Wide::load(&corners.last_level[first]);
    // Down to the finest for NaN as well.
    const Wide clamped = min(max(relative, Wide(0)), last);
    const Wide level = options.blend ? clamped : floor(clamped + Wide(0.5F));
    const Wide lower = floor(level);
    lower.store(&footprints.lower[first]);
    min(lower + Wide(1), last).store(&footprints.upper[first]);
    (level - lower).store(&footprints.weight[first]);
    // Taps closer than a texel of level 0 would be redundant.
    const Wide long_axis = sqrt(texel_footprint.axis_x * texel_footprint.axis_x +
                                texel_footprint.axis_y * texel_footprint.axis_y) +
                           Wide(1);
    const Wide parts = min(texel_footprint.ratio, long_axis);
    const Wide tap_limit(options.forced >= 0 ? 1.0F : static_cast<float>(options.taps));
    const Wide cut = max(min(floor(parts + Wide(0.999F)), tap_limit), Wide(1));
    if_greater(parts, Wide(1.001F), cut, Wide(1)).store(&footprints.taps[first]);
    const Wide farthest(1e6F);
    max(min(texel_footprint.axis_x / width, farthest), -farthest).store(&footprints.axis_u[first]);
    max(min(texel_footprint.axis_y / height, farthest), -farthest).store(&footprints.axis_v[first]);
  }
}
SELVEDGE_THREE_BODIES(interpolate_lanes,
                      (const Corners& corners, const LevelOptions& options, PixelBlock& block,
                       Footprints& footprints),
                      (corners, options, block, footprints))

/// Selects texels of a pixel.
struct Slot {
  int tap = 0;
  bool coarser = false;  ///< of the two levels
  bool linear = false;   ///< the four nearest texels if the level is above 0, else the nearest alone
};

/// Fills one list of texels, or four where `slot.linear`.
template <std::size_t N>
SELVEDGE_INLINE void fill_slot(const Corners& corners, const Footprints& footprints, const Slot& slot,
                               LaneTexels* lists) {
  using Wide = WideFloat<N>;
  const Wide zero(0);
  const Wide one(1);
  const Wide half(0.5F);
  for (std::size_t first = 0; first < lane_count; first += N) {
    const Wide taps = Wide::load(&footprints.taps[first]);
    const Wide tap(static_cast<float>(slot.tap));
    const Wide share = one / taps;
    const Wide along = (tap + half) * share - half;
    const Wide u = Wide::load(&footprints.u[first]) + along * Wide::load(&footprints.axis_u[first]);
    const Wide v = Wide::load(&footprints.v[first]) + along * Wide::load(&footprints.axis_v[first]);
    const Wide level = Wide::load(slot.coarser ? &footprints.upper[first] : &footprints.lower[first]);
    const Wide of_coarser = Wide::load(&footprints.weight[first]);
    const Wide of_level = slot.coarser ? of_coarser : one - of_coarser;
    const Wide counts = Wide::load(&corners.counts[first]);
    const Wide counted = if_greater(counts, zero, of_level * share * counts, zero);
    const Wide weight = if_greater(taps, tap, counted, zero);
    const Wide of_whole = Wide::load(&corners.first_level[first]) + level;
    const Wide scale = power_of_two(-of_whole);
    const Wide width = size_of_level<N>(Wide::load(&corners.width[first]), scale);
    const Wide height = size_of_level<N>(Wide::load(&corners.height[first]), scale);
    const auto store = [&](const Wide& x, const Wide& y, const Wide& part, LaneTexels& texels)
        __attribute__((always_inline)) {
      // Exact: at most 4096 x 4096 texels.
      store_whole(y * width + x, &texels.texel[first]);
      store_whole(level, &texels.level[first]);
      part.store(&texels.weight[first]);
    };
    const Wide x = wrap<N>(u, width);
    const Wide y = wrap<N>(v, height);
    if (!slot.linear) {
      store(x, y, weight, lists[0]);
      continue;
    }
    const Wide from_x = u * width - half;
    const Wide from_y = v * height - half;
    const Wide left = floor(from_x);
    const Wide upper = floor(from_y);
    const Wide part_x = from_x - left;
    const Wide part_y = from_y - upper;
    // Level 0 is not filtered, since its texels fade out towards level 1. But level 0 of a partial fabric is
    // a coarser level of the whole, so it is filtered.
    const auto choose = [&](const Wide& linear, const Wide& nearest) __attribute__((always_inline)) {
      return if_greater(of_whole, zero, linear, nearest);
    };
    const Wide x0 = choose(wrap<N>((left + half) / width, width), x);
    const Wide x1 = wrap<N>((left + Wide(1.5F)) / width, width);
    const Wide y0 = choose(wrap<N>((upper + half) / height, height), y);
    const Wide y1 = wrap<N>((upper + Wide(1.5F)) / height, height);
    const Wide share_x1 = choose(part_x, zero);
    const Wide share_y1 = choose(part_y, zero);
    store(x0, y0, weight * (one - share_x1) * (one - share_y1), lists[0]);
    store(x1, y0, weight * share_x1 * (one - share_y1), lists[1]);
    store(x0, y1, weight * (one - share_x1) * share_y1, lists[2]);
    store(x1, y1, weight * share_x1 * share_y1, lists[3]);
  }
}
SELVEDGE_THREE_BODIES(fill_slot,
                      (const Corners& corners, const Footprints& footprints, const Slot& slot,
                       LaneTexels* lists),
                      (corners, footprints, slot, lists))

/// Whether any pixel with a fabric has weight in one of the levels, and whether bilinear filtering matters
/// there.
struct LevelUse {
  bool seen = false;
  bool linear = false;
};
LevelUse use_of(const Corners& corners, const Footprints& footprints, bool coarser) {
  LevelUse use;
  for (std::size_t lane = 0; lane < lane_count; ++lane) {
    const bool seen =
        corners.counts[lane] > 0 && (coarser ? footprints.weight[lane] > 0 : footprints.weight[lane] < 1);
    use.seen |= seen;
    use.linear |=
        seen && corners.first_level[lane] + (coarser ? footprints.upper[lane] : footprints.lower[lane]) > 0;
  }
  return use;
}

/// Lists the texels of all pixels: taps along the footprint's longer axis, and bilinear neighbours of each
/// tap if options and footprints require them.
void list_texels(const Corners& corners, const Footprints& footprints, const LevelOptions& options,
                 PixelBlock& block) {
  static const auto fill = fill_slot_for_this_processor();
  float taps = 0;
  for (std::size_t lane = 0; lane < lane_count; ++lane)
    taps = std::max(taps, corners.counts[lane] > 0 ? footprints.taps[lane] : 0.0F);
  block.texel_count = 0;
  for (const bool coarser : {false, true}) {
    const LevelUse use = use_of(corners, footprints, coarser);
    if (!use.seen) continue;
    const bool linear = options.linear && use.linear;
    for (int tap = 0; tap < static_cast<int>(taps); ++tap) {
      fill(corners, footprints, {tap, coarser, linear}, &block.texels[block.texel_count]);
      block.texel_count += linear ? 4 : 1;
    }
  }
}

}  // namespace

void find_texels(const IndexScene& scene, const PixelTriangles& pixels, PixelBlock& block) {
  static const auto interpolate = interpolate_lanes_for_this_processor();
  block.count = pixels.count;
  block.x = pixels.x;
  block.y = pixels.y;
  if (pixels.has_pbr) block.pbr = pixels.pbr;
  Corners corners;
  const float middle_x = 0.5F * static_cast<float>(scene.projected.width) - 0.5F;
  const float middle_y = 0.5F * static_cast<float>(scene.projected.height) - 0.5F;
  // Neighbouring pixels are mostly on one surface.
  std::uint32_t known_surface = ~0U;
  float width = 1;
  float height = 1;
  float first_level = 0;
  float last_level = 0;
  float counts = 0;
  float yarn = 0;
  for (std::size_t lane = 0; lane < lane_count; ++lane) {
    // Inactive lanes repeat the first lane.
    const std::size_t source = lane < pixels.count ? lane : 0;
    const MergedTriangle& triangle = scene.mesh.triangles[pixels.triangle[source]];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t vertex = triangle.corners[k];
      corners.screen[k][lane] = &scene.projected.screen[vertex];
      corners.attributes[k][lane] = scene.mesh.attributes[vertex].data();
    }
    block.from_middle_x[lane] = static_cast<float>(pixels.x[source]) - middle_x;
    block.from_middle_y[lane] = static_cast<float>(pixels.y[source]) - middle_y;
    block.surface[lane] = triangle.surface;
    block.triangle[lane] = pixels.triangle[source];
    block.handedness[lane] = triangle.handedness;
    block.side[lane] = pixels.back[source] ? -1.0F : 1.0F;
    if (triangle.surface != known_surface) {
      known_surface = triangle.surface;
      const int fabric = scene.materials[known_surface].fabric;
      width = height = 1;
      first_level = last_level = 0;
      counts = fabric >= 0 ? 1 : 0;
      yarn = 0;
      if (fabric >= 0) {
        const PackedFabric& packed = scene.fabrics[fabric];
        const V2i texels = whole_texels(*packed.fabric);
        width = static_cast<float>(texels.x);
        height = static_cast<float>(texels.y);
        first_level = static_cast<float>(packed.fabric->first_level());
        yarn = packed.fabric->levels.front().yarns() ? 1 : 0;
        last_level = static_cast<float>(packed.levels.size() - 1);
      }
    }
    corners.width[lane] = width;
    corners.height[lane] = height;
    corners.first_level[lane] = first_level;
    corners.last_level[lane] = last_level;
    corners.counts[lane] = lane < pixels.count ? counts : 0;
    corners.yarn[lane] = lane < pixels.count ? yarn : 0;
  }
  Footprints footprints;
  interpolate(corners, scene.levels, block, footprints);
  block.shows_yarn = false;
  for (std::size_t lane = 0; lane < pixels.count; ++lane) {
    block.shows_yarn |= block.yarn[lane] > 0;
    corners.counts[lane] *= 1 - block.yarn[lane];
  }
  list_texels(corners, footprints, scene.levels, block);
}

}  // namespace selvedge
