#include "viewer/hybrid/index_pass.h"

#include <algorithm>
#include <cmath>

#include "format/scene/footprint.h"
#include "viewer/hybrid/fetch.h"
#include "viewer/hybrid/paper_bits.h"
#include "viewer/hybrid/pbr_shading.h"
#include "viewer/hybrid/texel_lists.h"

namespace selvedge {
namespace {

/// Data of the pixels' triangles.
struct Corners {
  std::array<std::array<const Group*, lane_count>, 3> screen;
  std::array<std::array<const Group*, lane_count>, 3> attributes;
  alignas(64) LaneFloats last_level;
  alignas(64) LaneFloats largest_yarn_pixel;
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
    const Wide largest = options.forced >= 0 ? Wide(0) : Wide::load(&corners.largest_yarn_pixel[first]);
    yarn_share(size, largest * Wide(largest_by_points(options.points)), options.blend)
        .store(&block.yarn[first]);
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
        yarn = packed.largest_yarn_pixel;
        last_level = static_cast<float>(packed.levels.size() - 1);
      }
    }
    texels.width[lane] = width;
    texels.height[lane] = height;
    corners.last_level[lane] = last_level;
    texels.counts[lane] = lane < pixels.count ? counts : 0;
    corners.largest_yarn_pixel[lane] = lane < pixels.count ? yarn : 0;
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
