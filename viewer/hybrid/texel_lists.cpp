#include "viewer/hybrid/texel_lists.h"

#include <algorithm>
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
  result.scale = power_of_two(-(Wide::load(&inputs.first_level[first]) + result.number));
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

/// Fills the list of the texels in a row and a column of the boxes, and adds their shares to `sum`.
template <std::size_t N>
SELVEDGE_INLINE void list_area(const TexelInputs& inputs, const LaneBoxes& boxes, bool coarser,
                               const V2i& place, LaneFloats& sum, LaneTexels& list) {
  using Wide = WideFloat<N>;
  for (std::size_t first = 0; first < lane_count; first += N) {
    const auto load = [&](const LaneFloats& values) __attribute__((always_inline)) {
      return Wide::load(&values[first]);
    };
    const PixelBox<Wide> box{load(boxes.box.across_x),     load(boxes.box.across_y),
                             load(boxes.box.along_x),      load(boxes.box.along_y),
                             load(boxes.box.texel_across), load(boxes.box.texel_along),
                             load(boxes.box.reach_x),      load(boxes.box.reach_y)};
    const WideLevel<N> level = level_of<N>(inputs, coarser, first);
    const Wide x = load(boxes.left) + Wide(static_cast<float>(place.x));
    const Wide y = load(boxes.top) + Wide(static_cast<float>(place.y));
    const Wide half(0.5F);
    const Wide share =
        texel_share<Wide>(box, x + half - load(boxes.centre_x), y + half - load(boxes.centre_y)) *
        if_greater(load(inputs.counts), Wide(0), Wide(1), Wide(0));
    (load(sum) + share).store(&sum[first]);
    share.store(&list.weight[first]);
    // Texels beyond the border are those of the next repeat.
    const auto within = [](const Wide& c, const Wide& size) __attribute__((always_inline)) {
      return max(min(c - floor(c / size) * size, size - Wide(1)), Wide(0));
    };
    store_whole(within(y, level.height) * level.width + within(x, level.width), &list.texel[first]);
    store_whole(level.number, &list.level[first]);
  }
}
SELVEDGE_THREE_BODIES(list_area,
                      (const TexelInputs& inputs, const LaneBoxes& boxes, bool coarser, const V2i& place,
                       LaneFloats& sum, LaneTexels& list),
                      (inputs, boxes, coarser, place, sum, list))

/// Makes weights of shares.
template <std::size_t N>
SELVEDGE_INLINE void normalise(const TexelInputs& inputs, bool coarser, const LaneFloats& sum,
                               std::span<LaneTexels> lists) {
  using Wide = WideFloat<N>;
  for (std::size_t first = 0; first < lane_count; first += N) {
    const Wide total = Wide::load(&sum[first]);
    const Wide factor = if_greater(total, Wide(0), level_share<N>(inputs, coarser, first) / total, Wide(0));
    for (LaneTexels& list : lists) (Wide::load(&list.weight[first]) * factor).store(&list.weight[first]);
  }
}
SELVEDGE_THREE_BODIES(normalise,
                      (const TexelInputs& inputs, bool coarser, const LaneFloats& sum,
                       std::span<LaneTexels> lists),
                      (inputs, coarser, sum, lists))

/// Adds the texels of one of the pixels' levels to the block.
void list_level(const TexelInputs& inputs, bool area, bool coarser, PixelBlock& block) {
  static const auto nearest = list_nearest_for_this_processor();
  static const auto boxes_of = find_boxes_for_this_processor();
  static const auto fill = list_area_for_this_processor();
  static const auto weigh = normalise_for_this_processor();
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
  const std::size_t begin = block.texel_count;
  alignas(64) LaneFloats sum{};
  const V2i size(static_cast<int>(std::ceil(2 * reach.x)), static_cast<int>(std::ceil(2 * reach.y)));
  for (int row = 0; row < size.y; ++row) {
    for (int column = 0; column < size.x; ++column) {
      LaneTexels& list = block.texels[block.texel_count];
      fill(inputs, boxes, coarser, V2i(column, row), sum, list);
      const bool any = std::any_of(list.weight.begin(), list.weight.end(), [](float w) { return w > 0; });
      block.texel_count += any ? 1 : 0;
    }
  }
  weigh(inputs, coarser, sum, std::span(block.texels).subspan(begin, block.texel_count - begin));
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
