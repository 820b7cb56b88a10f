#include "viewer/hybrid/index_pass.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "format/scene/footprint.h"
#include "format/simd/fetch.h"
#include "viewer/hybrid/pbr_shading.h"

namespace selvedge {
namespace {

// The last step: texels and their weights (format/scene/footprint.h).

/// What a pixel shows of its fabric.
struct TexelInputs {
  alignas(64) LaneFloats u;  ///< of its centre, in [0, 1]
  alignas(64) LaneFloats v;
  alignas(64) LaneFloats lower;   ///< the finer of its two levels in the file
  alignas(64) LaneFloats upper;   ///< the coarser
  alignas(64) LaneFloats weight;  ///< of the coarser
  alignas(64) LaneFloats size;    ///< pixel_size() in texels of level 0 of the whole fabric
  alignas(64) LaneFloats width;   ///< of level 0 of the whole fabric
  alignas(64) LaneFloats height;
  alignas(64) LaneFloats counts;  ///< weight of texels: 0 without a fabric, less than 1 beside yarn
};

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

/// Sizes of one of the pixels' two levels.
template <std::size_t N>
struct WideLevel {
  WideFloat<N> number, scale, width, height;
};

template <std::size_t N>
SELVEDGE_INLINE WideLevel<N> level_of(const TexelInputs& inputs, bool coarser, std::size_t first) {
  using Wide = WideFloat<N>;
  WideLevel<N> result;
  result.number = Wide::load(coarser ? &inputs.upper[first] : &inputs.lower[first]);
  result.scale = power_of_two(-result.number);
  result.width = size_of_level<N>(Wide::load(&inputs.width[first]), result.scale);
  result.height = size_of_level<N>(Wide::load(&inputs.height[first]), result.scale);
  return result;
}

template <std::size_t N>
SELVEDGE_INLINE WideFloat<N> level_share(const TexelInputs& inputs, bool coarser, std::size_t first) {
  using Wide = WideFloat<N>;
  const Wide of_upper = Wide::load(&inputs.weight[first]);
  return (coarser ? of_upper : Wide(1) - of_upper) * Wide::load(&inputs.counts[first]);
}

template <std::size_t N>
SELVEDGE_INLINE void list_nearest(const TexelInputs& inputs, bool coarser, LaneTexels& list) {
  using Wide = WideFloat<N>;
  for (std::size_t first = 0; first < lane_count; first += N) {
    const WideLevel<N> level = level_of<N>(inputs, coarser, first);
    const Wide x = wrap<N>(Wide::load(&inputs.u[first]), level.width);
    const Wide y = wrap<N>(Wide::load(&inputs.v[first]), level.height);
    // Exact: at most 4096 x 4096 texels.
    store_whole(y * level.width + x, &list.texel[first]);
    store_whole(level.number, &list.level[first]);
    level_share<N>(inputs, coarser, first).store(&list.weight[first]);
  }
}
SELVEDGE_THREE_BODIES(list_nearest, (const TexelInputs& inputs, bool coarser, LaneTexels& list),
                      (inputs, coarser, list))

/// The pixels among the texels of one of their levels.
struct LaneBoxes {
  PixelBox<LaneFloats> box;
  alignas(64) LaneFloats centre_x, centre_y;  ///< texels
  alignas(64) LaneFloats left, top;           ///< the first texel with a share
};

/// Sets the boxes, and how many texels reach into the widest and into the highest.
template <std::size_t N>
SELVEDGE_INLINE void find_boxes(const TexelInputs& inputs, const PixelBlock& block, bool coarser,
                                LaneBoxes& boxes) {
  using Wide = WideFloat<N>;
  for (std::size_t first = 0; first < lane_count; first += N) {
    const WideLevel<N> level = level_of<N>(inputs, coarser, first);
    const auto in_texels = [&](const LaneFloats& slope, const Wide& size) __attribute__((always_inline)) {
      const Wide farthest(1e6F);
      return max(min(Wide::load(&slope[first]) * size, farthest), -farthest);
    };
    const PixelBox<Wide> box =
        pixel_box<Wide>({in_texels(block.u_right, level.width), in_texels(block.v_right, level.height),
                         in_texels(block.u_up, level.width), in_texels(block.v_up, level.height)},
                        Wide::load(&inputs.size[first]) * level.scale);
    box.across_x.store(&boxes.box.across_x[first]);
    box.across_y.store(&boxes.box.across_y[first]);
    box.along_x.store(&boxes.box.along_x[first]);
    box.along_y.store(&boxes.box.along_y[first]);
    box.texel_across.store(&boxes.box.texel_across[first]);
    box.texel_along.store(&boxes.box.texel_along[first]);
    box.reach_x.store(&boxes.box.reach_x[first]);
    box.reach_y.store(&boxes.box.reach_y[first]);
    const Wide x = Wide::load(&inputs.u[first]) * level.width;
    const Wide y = Wide::load(&inputs.v[first]) * level.height;
    x.store(&boxes.centre_x[first]);
    y.store(&boxes.centre_y[first]);
    floor(x - box.reach_x + Wide(0.5F)).store(&boxes.left[first]);
    floor(y - box.reach_y + Wide(0.5F)).store(&boxes.top[first]);
  }
}
SELVEDGE_THREE_BODIES(find_boxes,
                      (const TexelInputs& inputs, const PixelBlock& block, bool coarser, LaneBoxes& boxes),
                      (inputs, block, coarser, boxes))

/// Fills lists with the texels of the boxes, row by row, and makes weights of their shares. Sets the bits
/// of lists that have any.
template <std::size_t N>
SELVEDGE_INLINE void list_area(const TexelInputs& inputs, const LaneBoxes& boxes, bool coarser,
                               const V2i& size, LaneTexels* lists, std::uint64_t& found) {
  using Wide = WideFloat<N>;
  const Wide zero(0);
  const Wide one(1);
  for (std::size_t first = 0; first < lane_count; first += N) {
    const auto load = [&](const LaneFloats& values) __attribute__((always_inline)) {
      return Wide::load(&values[first]);
    };
    const PixelBox<Wide> box{load(boxes.box.across_x),     load(boxes.box.across_y),
                             load(boxes.box.along_x),      load(boxes.box.along_y),
                             load(boxes.box.texel_across), load(boxes.box.texel_along),
                             load(boxes.box.reach_x),      load(boxes.box.reach_y)};
    const WideLevel<N> level = level_of<N>(inputs, coarser, first);
    const Wide counts = if_greater(load(inputs.counts), zero, one, zero);
    // Texels beyond the border are those of the next repeat.
    const auto within = [&](const Wide& c, const Wide& count) __attribute__((always_inline)) {
      return max(min(c - floor(c / count) * count, count - one), zero);
    };
    Wide columns[max_pixel_texels];  // NOLINT(modernize-avoid-c-arrays)
    for (int column = 0; column < size.x; ++column)
      columns[column] = within(load(boxes.left) + Wide(static_cast<float>(column)), level.width);
    const Wide from_x = load(boxes.left) + Wide(0.5F) - load(boxes.centre_x);
    const Wide from_y = load(boxes.top) + Wide(0.5F) - load(boxes.centre_y);
    Wide sum(0);
    for (int row = 0; row < size.y; ++row) {
      const Wide begin = within(load(boxes.top) + Wide(static_cast<float>(row)), level.height) * level.width;
      for (int column = 0; column < size.x; ++column) {
        const int number = row * size.x + column;
        LaneTexels& list = lists[number];
        const Wide share = texel_share<Wide>(box, from_x + Wide(static_cast<float>(column)),
                                             from_y + Wide(static_cast<float>(row))) *
                           counts;
        sum += share;
        share.store(&list.weight[first]);
        store_whole(begin + columns[column], &list.texel[first]);
        store_whole(level.number, &list.level[first]);
        found |= static_cast<std::uint64_t>(any_greater(share, zero)) << number;
      }
    }
    const Wide factor = if_greater(sum, zero, level_share<N>(inputs, coarser, first) / sum, zero);
    for (int number = 0; number < size.x * size.y; ++number)
      (Wide::load(&lists[number].weight[first]) * factor).store(&lists[number].weight[first]);
  }
}
SELVEDGE_THREE_BODIES(list_area,
                      (const TexelInputs& inputs, const LaneBoxes& boxes, bool coarser, const V2i& size,
                       LaneTexels* lists, std::uint64_t& found),
                      (inputs, boxes, coarser, size, lists, found))

/// Adds the texels of one of the pixels' levels to the block.
void list_level(const TexelInputs& inputs, bool area, bool coarser, PixelBlock& block) {
  static const auto nearest = list_nearest_for_this_processor();
  static const auto boxes_of = find_boxes_for_this_processor();
  static const auto fill = list_area_for_this_processor();
  if (!area) {
    nearest(inputs, coarser, block.texels[block.texel_count++]);
    return;
  }
  LaneBoxes boxes;
  boxes_of(inputs, block, coarser, boxes);
  V2f reach(0, 0);
  for (std::size_t lane = 0; lane < lane_count; ++lane) {
    if (!(inputs.counts[lane] > 0)) continue;
    reach.x = std::max(reach.x, boxes.box.reach_x[lane]);
    reach.y = std::max(reach.y, boxes.box.reach_y[lane]);
  }
  const V2i size(static_cast<int>(std::ceil(2 * reach.x)), static_cast<int>(std::ceil(2 * reach.y)));
  LaneTexels* const lists = &block.texels[block.texel_count];
  std::uint64_t found = 0;
  fill(inputs, boxes, coarser, size, lists, found);
  for (std::size_t kept = 0; found != 0; found &= found - 1, ++kept, ++block.texel_count) {
    const auto number = static_cast<std::size_t>(std::countr_zero(found));
    if (number != kept) lists[kept] = lists[number];
  }
}

/// Fills the block's texels. The block has the changes of texture coordinates.
void list_texels(const TexelInputs& inputs, const LevelOptions& options, PixelBlock& block) {
  block.texel_count = 0;
  for (const bool coarser : {false, true}) {
    bool seen = false;
    for (std::size_t lane = 0; lane < lane_count; ++lane) {
      const float of_upper = inputs.weight[lane];
      seen |= inputs.counts[lane] > 0 && (coarser ? of_upper > 0 : of_upper < 1);
    }
    if (seen) list_level(inputs, options.area && options.forced < 0, coarser, block);
  }
}

// The published path (Daubert et al. 2001, section 6), whose index pass writes colours of 8 bits.

/// Difference of adjacent levels in blue, of 255: levels are 0, 0.1, 0.2 and so on.
constexpr float level_step = 25.5F;
/// Shorter vectors are not unit vectors of 8 bits: the tangent is missing.
constexpr float min_tangent2 = 0.25F;

/// A component n of a direction is coded as (n + 1) / 2; its error is at most 1/255.
float rounded(float n) { return std::round(std::clamp((n + 1) / 2, 0.0F, 1.0F) * 255) / 127.5F - 1; }

void round_lane(LaneDirections& d, std::size_t lane) {
  d.x[lane] = rounded(d.x[lane]);
  d.y[lane] = rounded(d.y[lane]);
  d.z[lane] = rounded(d.z[lane]);
}

/// The middle of the texel, of `size` along this axis, at coordinate c in [0, 1].
float middle_of_texel(float c, int size) {
  const auto count = static_cast<float>(size);
  return (std::clamp(std::floor(c * count), 0.0F, count - 1) + 0.5F) / count;
}

/// Rounds normals and tangents of the block, and levels and texels of `texels`, to colours of 8 bits. The
/// second pass of the blending takes the texel of the coarser level at the centre of the finer level's texel.
/// Yarn shows as texels of level 0.
void round_to_paper_bits(const IndexScene& scene, PixelBlock& block, TexelInputs& texels) {
  block.yarn = {};
  for (std::size_t lane = 0; lane < lane_count; ++lane) {
    const int fabric = scene.materials[block.surface[lane]].fabric;
    if (fabric < 0) continue;
    round_lane(block.normal, lane);
    round_lane(block.tangent, lane);
    LaneDirections& t = block.tangent;
    const float length2 = t.x[lane] * t.x[lane] + t.y[lane] * t.y[lane] + t.z[lane] * t.z[lane];
    if (!(length2 > min_tangent2)) t.x[lane] = t.y[lane] = t.z[lane] = 0;

    if (scene.levels.blend) {
      const float blue = std::round((texels.lower[lane] + texels.weight[lane]) * level_step) / level_step;
      texels.weight[lane] = std::clamp(blue - texels.lower[lane], 0.0F, 1.0F);
    } else if (texels.weight[lane] > 0) {
      texels.lower[lane] = texels.upper[lane];
      texels.weight[lane] = 0;
    }
    const std::vector<PackedLevel>& levels = scene.fabrics[fabric].levels;
    const PackedLevel& finer = levels[static_cast<std::size_t>(texels.lower[lane])];
    texels.u[lane] = middle_of_texel(texels.u[lane], finer.width);
    texels.v[lane] = middle_of_texel(texels.v[lane], finer.height);
  }
}

// The first step: interpolation over the triangles.

/// Data of the pixels' triangles.
struct Corners {
  std::array<std::array<const Group*, lane_count>, 3> screen;
  std::array<std::array<const Group*, lane_count>, 3> attributes;
  alignas(64) LaneFloats last_level;
  alignas(64) LaneFloats largest_cell_pixel;
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
SELVEDGE_INLINE Coordinate<N> coordinate(const Interpolation<N>& at, const WideFloat<N>* corner,
                                         float footprint) {
  using Wide = WideFloat<N>;
  const Wide one = corner[1] - corner[0];
  const Wide two = corner[2] - corner[0];
  // This subtraction is exact.
  const Wide start = corner[0] - floor(corner[0]);
  const Wide side(footprint);
  return {start + (at.l1 * one + at.l2 * two), (at.l1_right * one + at.l2_right * two) * side,
          (at.l1_up * one + at.l2_up * two) * side};
}

template <std::size_t N>
SELVEDGE_INLINE void interpolate_lanes(const Corners& corners, const LevelOptions& options, PixelBlock& block,
                                       TexelInputs& texels) {
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
    const Coordinate<N> u = coordinate<N>(at, us, options.footprint);
    const Coordinate<N> v = coordinate<N>(at, vs, options.footprint);
    const Wide width = Wide::load(&texels.width[first]);
    const Wide height = Wide::load(&texels.height[first]);
    const Wide size = pixel_size<Wide>({u.right * width, v.right * height, u.up * width, v.up * height});
    size.store(&texels.size[first]);
    // 0 where coordinates overflow.
    const Wide in_u = max(u.value - floor(u.value), Wide(0));
    const Wide in_v = max(v.value - floor(v.value), Wide(0));
    in_u.store(&texels.u[first]);
    in_v.store(&texels.v[first]);
    in_u.store(&block.u[first]);
    in_v.store(&block.v[first]);
    u.right.store(&block.u_right[first]);
    v.right.store(&block.v_right[first]);
    u.up.store(&block.u_up[first]);
    v.up.store(&block.v_up[first]);
    const Wide wanted =
        options.forced >= 0 ? Wide(static_cast<float>(options.forced)) : wide_log2(size) + Wide(options.bias);
    const Wide largest = options.forced >= 0 ? Wide(0) : Wide::load(&corners.largest_cell_pixel[first]);
    yarn_share(size, largest, options.blend).store(&block.yarn[first]);
    const Wide last = Wide::load(&corners.last_level[first]);
    // Level 0 for NaN as well.
    const Wide level = min(max(wanted, Wide(0)), last);
    const Wide lower = floor(level);
    lower.store(&texels.lower[first]);
    min(lower + Wide(1), last).store(&texels.upper[first]);
    blend_of_levels(level - lower, options.blend).store(&texels.weight[first]);
  }
}
SELVEDGE_THREE_BODIES(interpolate_lanes,
                      (const Corners& corners, const LevelOptions& options, PixelBlock& block,
                       TexelInputs& texels),
                      (corners, options, block, texels))

/// The slopes of normal textures that bend fabrics.
void find_slopes(const IndexScene& scene, PixelPlaces& block) {
  block.bent = false;
  block.slope_x = block.slope_y = {};
  for (std::size_t lane = 0; lane < block.count; ++lane) {
    if (!scene.materials[block.surface[lane]].bends) continue;
    const V2f slope = pbr_values(block.pbr[lane]).slope;
    block.bent = true;
    block.slope_x[lane] = slope.x;
    block.slope_y[lane] = slope.y;
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
  TexelInputs texels;
  const float middle_x = 0.5F * static_cast<float>(scene.projected.width) - 0.5F;
  const float middle_y = 0.5F * static_cast<float>(scene.projected.height) - 0.5F;
  // Neighbouring pixels are mostly on one surface.
  std::uint32_t known_surface = ~0U;
  float width = 1;
  float height = 1;
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
      last_level = 0;
      counts = fabric >= 0 ? 1 : 0;
      yarn = 0;
      if (fabric >= 0) {
        const PackedFabric& packed = scene.fabrics[fabric];
        const V2i size = packed.fabric->texels();
        width = static_cast<float>(size.x);
        height = static_cast<float>(size.y);
        yarn = scene.cells ? packed.largest_cell_pixel : 0;
        last_level = static_cast<float>(packed.levels.size() - 1);
      }
    }
    texels.width[lane] = width;
    texels.height[lane] = height;
    corners.last_level[lane] = last_level;
    texels.counts[lane] = lane < pixels.count ? counts : 0;
    corners.largest_cell_pixel[lane] = lane < pixels.count ? yarn : 0;
  }

  if (pixels.has_pbr) find_slopes(scene, block);
  interpolate(corners, scene.levels, block, texels);
  if (scene.paper_bits) round_to_paper_bits(scene, block, texels);
  block.shows_yarn = false;
  for (std::size_t lane = 0; lane < pixels.count; ++lane) {
    block.shows_yarn |= block.yarn[lane] > 0;
    texels.counts[lane] *= 1 - block.yarn[lane];
  }
  list_texels(texels, scene.levels, block);
}

}  // namespace selvedge
