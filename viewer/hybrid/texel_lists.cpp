#include "viewer/hybrid/texel_lists.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "format/scene/footprint.h"

namespace selvedge {
namespace {

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

}  // namespace

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

}  // namespace selvedge
