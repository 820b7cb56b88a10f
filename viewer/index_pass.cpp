#include "viewer/index_pass.h"

#include <algorithm>
#include <cmath>

#include "format/evaluate.h"
#include "format/footprint.h"
#include "viewer/fetch.h"

namespace selvedge {
namespace {

/// Per pixel, what choosing the texels needs.
struct Footprints {
  alignas(64) LaneFloats u;  ///< in [0, 1]
  alignas(64) LaneFloats v;
  alignas(64) LaneFloats parts;       ///< into which the footprint is cut, one tap for each
  std::array<LaneTexels, 2> nearest;  ///< those of the two levels at (u, v)
  alignas(64) LaneFloats axis_u;      ///< in texture coordinates
  alignas(64) LaneFloats axis_v;
};

/// What the pixels' triangles are made of.
struct Corners {
  std::array<std::array<const Group*, lane_count>, 3> screen;
  std::array<std::array<const Group*, lane_count>, 3> attributes;
  alignas(64) LaneFloats width;  ///< of level 0 of the whole fabric
  alignas(64) LaneFloats height;
  alignas(64) LaneFloats first_level;  ///< of the whole fabric that is there; the others are counted from it
  alignas(64) LaneFloats last_level;
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

/// Homogeneous: works for corners behind the viewer, and is right in perspective (after Olano and Greer
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

/// Texture coordinate from those of the corners: its value with whole repeats of the first corner taken off,
/// and its change per pixel.
template <std::size_t N>
struct Coordinate {
  WideFloat<N> value, right, up;
};

template <std::size_t N>
SELVEDGE_INLINE Coordinate<N> coordinate(const Interpolation<N>& at, const WideFloat<N>* corner) {
  using Wide = WideFloat<N>;
  const Wide one = corner[1] - corner[0];
  const Wide two = corner[2] - corner[0];
  // Exact: what is left has no more digits than before.
  const Wide start = corner[0] - floor(corner[0]);
  return {start + (at.l1 * one + at.l2 * two), at.l1_right * one + at.l2_right * two,
          at.l1_up * one + at.l2_up * two};
}

/// The texel at (u, v) in [0, 1] of a level, whose size follows from that of the whole fabric's level 0
/// (level_size()); `before` levels lie between them.
template <std::size_t N>
SELVEDGE_INLINE void choose_texel(const WideFloat<N>& width0, const WideFloat<N>& height0,
                                  const WideFloat<N>& before, const WideFloat<N>& level,
                                  const WideFloat<N>& u, const WideFloat<N>& v, LaneTexels& to,
                                  std::size_t first) {
  using Wide = WideFloat<N>;
  const Wide scale = power_of_two(-(before + level));
  const Wide width = max(floor(width0 * scale), Wide(1));
  const Wide height = max(floor(height0 * scale), Wide(1));
  const Wide x = min(floor(u * width), width - Wide(1));
  const Wide y = min(floor(v * height), height - Wide(1));
  // Exact: at most 4096 x 4096 texels.
  store_whole(y * width + x, &to.texel[first]);
  store_whole(level, &to.level[first]);
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
    const Footprint<Wide> of = footprint<Wide>(
        {u.right * width, v.right * height, u.up * width, v.up * height}, static_cast<float>(options.taps));
    // 0 where coordinates overflow.
    const Wide in_u = max(u.value - floor(u.value), Wide(0));
    const Wide in_v = max(v.value - floor(v.value), Wide(0));
    in_u.store(&footprints.u[first]);
    in_v.store(&footprints.v[first]);
    const Wide before = Wide::load(&corners.first_level[first]);
    const Wide wanted =
        (options.forced >= 0 ? Wide(static_cast<float>(options.forced)) : of.level + Wide(options.bias)) -
        before;
    const Wide last = Wide::load(&corners.last_level[first]);
    // Down to the finest for NaN as well.
    const Wide clamped = min(max(wanted, Wide(0)), last);
    const Wide level = options.blend ? clamped : floor(clamped + Wide(0.5F));
    const Wide lower = floor(level);
    const Wide upper = min(lower + Wide(1), last);
    choose_texel<N>(width, height, before, lower, in_u, in_v, footprints.nearest[0], first);
    choose_texel<N>(width, height, before, upper, in_u, in_v, footprints.nearest[1], first);
    (Wide(1) - (level - lower)).store(&footprints.nearest[0].weight[first]);
    (level - lower).store(&footprints.nearest[1].weight[first]);
    // Parts that are smaller than a texel of level 0 need no tap of their own.
    const Wide long_axis = sqrt(of.axis_x * of.axis_x + of.axis_y * of.axis_y) + Wide(1);
    min(of.ratio, long_axis).store(&footprints.parts[first]);
    const Wide farthest(1e6F);
    max(min(of.axis_x / width, farthest), -farthest).store(&footprints.axis_u[first]);
    max(min(of.axis_y / height, farthest), -farthest).store(&footprints.axis_v[first]);
  }
}
SELVEDGE_THREE_BODIES(interpolate_lanes,
                      (const Corners& corners, const LevelOptions& options, PixelBlock& block,
                       Footprints& footprints),
                      (corners, options, block, footprints))

void set_texel(LaneTexels& to, std::size_t lane, int level, int texel, float weight) {
  to.level[lane] = level;
  to.texel[lane] = texel;
  to.weight[lane] = weight;
}

/// The four texels around (u, v), weighted by distance.
void set_linear(const PackedLevel& of, int level, const V2d& uv, float weight, std::size_t lane,
                std::span<LaneTexels, 4> to) {
  const V2d at(uv.x * of.width - 0.5, uv.y * of.height - 0.5);
  const V2d corner(std::floor(at.x), std::floor(at.y));
  const V2f part(at - corner);
  for (std::size_t k = 0; k < 4; ++k) {
    const bool right = (k & 1U) != 0;
    const bool down = (k & 2U) != 0;
    const int x = wrap_texel((corner.x + (right ? 1.5 : 0.5)) / of.width, of.width);
    const int y = wrap_texel((corner.y + (down ? 1.5 : 0.5)) / of.height, of.height);
    const float share = (right ? part.x : 1 - part.x) * (down ? part.y : 1 - part.y);
    set_texel(to[k], lane, level, y * of.width + x, weight * share);
  }
}

/// Spreads the two texels of a pixel over taps along the footprint's longer axis and over the texels around
/// each, where the options and the footprint want it. Gives how many texels there are.
std::size_t spread(const PackedFabric& fabric, const LevelOptions& options, const Footprints& at,
                   std::size_t lane, PixelBlock& block) {
  const std::array<LaneTexels, 2>& whole = at.nearest;
  const bool one_tap = options.taps == 1 || options.forced >= 0 || !(at.parts[lane] > 1.001F);
  const bool is_part = first_level(*fabric.fabric) > 0;
  const bool minified = is_part || whole[0].level[lane] > 0 || whole[1].weight[lane] > 0;
  const bool linear = options.linear && minified;
  const std::size_t per_level = linear ? 4 : 1;
  const int taps = one_tap ? 1 : std::min(static_cast<int>(at.parts[lane] + 0.999F), options.taps);
  const float share = 1 / static_cast<float>(taps);
  std::size_t count = 0;
  for (int tap = 0; tap < taps; ++tap) {
    const float along = (static_cast<float>(tap) + 0.5F) * share - 0.5F;
    const V2d uv(static_cast<double>(at.u[lane] + along * at.axis_u[lane]),
                 static_cast<double>(at.v[lane] + along * at.axis_v[lane]));
    for (const LaneTexels& of : whole) {
      const float weight = share * of.weight[lane];
      if (weight == 0) continue;
      const int number = of.level[lane];
      const PackedLevel& level = fabric.levels[static_cast<std::size_t>(number)];
      // Level 0 has weight only on the way to level 1: its texels' edges fade with it. The first level of a
      // part of a fabric is none such.
      if (linear && (is_part || number > 0)) {
        set_linear(level, number, uv, weight, lane, std::span<LaneTexels, 4>(&block.texels[count], 4));
        count += per_level;
      } else {
        set_texel(block.texels[count++], lane, number,
                  wrap_texel(uv.y, level.height) * level.width + wrap_texel(uv.x, level.width), weight);
      }
    }
  }
  return count;
}

}  // namespace

void find_texels(const IndexScene& scene, const PixelTriangles& pixels, PixelBlock& block) {
  static const auto interpolate = interpolate_lanes_for_this_processor();
  block.count = pixels.count;
  block.x = pixels.x;
  block.y = pixels.y;
  if (pixels.has_colours) block.colour = pixels.colour;
  Corners corners;
  for (std::size_t lane = 0; lane < lane_count; ++lane) {
    // Idle lanes go along with the first.
    const std::size_t from = lane < pixels.count ? lane : 0;
    const MergedTriangle& triangle = scene.mesh.triangles[pixels.triangle[from]];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t vertex = triangle.corners[k];
      corners.screen[k][lane] = &scene.projected.screen[vertex];
      corners.attributes[k][lane] = scene.mesh.attributes[vertex].data();
    }
    block.from_middle_x[lane] =
        static_cast<float>(pixels.x[from]) + 0.5F - 0.5F * static_cast<float>(scene.projected.width);
    block.from_middle_y[lane] =
        static_cast<float>(pixels.y[from]) + 0.5F - 0.5F * static_cast<float>(scene.projected.height);
    block.surface[lane] = triangle.surface;
    block.triangle[lane] = pixels.triangle[from];
    block.handedness[lane] = triangle.handedness;
    block.side[lane] = pixels.back[from] ? -1.0F : 1.0F;
    const int fabric = scene.looks[triangle.surface].fabric;
    corners.width[lane] = corners.height[lane] = 1;
    corners.first_level[lane] = corners.last_level[lane] = 0;
    if (fabric < 0) continue;
    const PackedFabric& packed = scene.fabrics[static_cast<std::size_t>(fabric)];
    const V2i texels = whole_texels(*packed.fabric);
    corners.width[lane] = static_cast<float>(texels.x);
    corners.height[lane] = static_cast<float>(texels.y);
    corners.first_level[lane] = static_cast<float>(first_level(*packed.fabric));
    corners.last_level[lane] = static_cast<float>(packed.levels.size() - 1);
  }
  Footprints footprints;
  interpolate(corners, scene.levels, block, footprints);
  block.texels[0] = footprints.nearest[0];
  block.texels[1] = footprints.nearest[1];
  block.texel_count = 0;
  const bool spreads = scene.levels.linear || scene.levels.taps > 1;
  std::array<std::size_t, lane_count> own{};
  for (std::size_t lane = 0; lane < block.count; ++lane) {
    const int fabric = scene.looks[block.surface[lane]].fabric;
    if (fabric < 0) continue;
    own[lane] = 2;
    if (spreads)
      own[lane] =
          spread(scene.fabrics[static_cast<std::size_t>(fabric)], scene.levels, footprints, lane, block);
    block.texel_count = std::max(block.texel_count, own[lane]);
  }
  for (std::size_t lane = 0; lane < lane_count; ++lane) {
    for (std::size_t i = own[lane]; i < block.texel_count; ++i) block.texels[i].weight[lane] = 0;
  }
}

}  // namespace selvedge
