// Look-up of pixels in cell images: their places, the texels there, and variation.
#include <bit>
#include <cmath>
#include <cstddef>

#include "format/simd/fetch.h"
#include "format/simd/wide_float.h"
#include "viewer/cells/cell_pass.h"
#include "viewer/cells/varied_pixels.h"

namespace selvedge {
namespace {

/// Repeats and places within them at pixels, the units there, and brightness.
struct LanePlaces {
  alignas(64) std::array<std::int32_t, lane_count> repeat_u, repeat_v, unit;
  alignas(64) LaneFloats u, v, brightness, slope_x, slope_y;
};

struct PlaneLanes {
  std::array<const Group*, lane_count> from;
  const CellPixels* pixels = nullptr;
  float units = 1;  ///< Patches::units_per_repeat()
};

template <std::size_t N>
SELVEDGE_INLINE void place_lanes(const PlaneLanes& planes, LanePlaces& to) {
  using Wide = WideFloat<N>;
  for (std::size_t first = 0; first < lane_count; first += N) {
    Wide c[20];  // NOLINT(modernize-avoid-c-arrays): GCC keeps it in registers
    for (std::size_t group = 0; group < 5; ++group) fetch<N>(&planes.from[first], group, c + 4 * group);
    const Wide x = Wide::load(&planes.pixels->x[first]);
    const Wide y = Wide::load(&planes.pixels->y[first]);
    const Wide one(1);
    const Wide units(planes.units);
    const Wide sum = c[0] * x + c[1] * y + c[2];
    const Wide inverse = if_greater(abs(sum), Wide(0), one / sum, Wide(0));
    // The place within the repeat; returns its unit.
    const auto place = [&](std::size_t k, LaneFloats & in_repeat,
                           std::array<std::int32_t, lane_count> & repeat) __attribute__((always_inline)) {
      const Wide farthest(1e8F);
      const Wide at = max(min((c[k] * x + c[k + 1] * y + c[k + 2]) * inverse, farthest), -farthest);
      const Wide whole = floor(at);
      const Wide within = min(max(at - whole, Wide(0)), one);
      within.store(&in_repeat[first]);
      store_whole(whole, &repeat[first]);
      return min(floor(within * units), units - one);
    };
    const Wide unit_u = place(3, to.u, to.repeat_u);
    const Wide unit_v = place(6, to.v, to.repeat_v);
    store_whole(unit_u + unit_v * units, &to.unit[first]);
    ((c[9] * x + c[10] * y + c[11]) * inverse).store(&to.brightness[first]);
    ((c[12] * x + c[13] * y + c[14]) * inverse).store(&to.slope_x[first]);
    ((c[15] * x + c[16] * y + c[17]) * inverse).store(&to.slope_y[first]);
  }
}
SELVEDGE_THREE_BODIES(place_lanes, (const PlaneLanes& planes, LanePlaces& to), (planes, to))

using Quad = Lanes<4>::Floats;
using Octet = Lanes<8>::Floats;
using Halves = std::uint16_t __attribute__((vector_size(16)));

/// Looks of the lanes, and their texels.
struct LookLanes {
  std::array<const CellLook*, lane_count> looks;
  alignas(64) std::array<std::int32_t, lane_count> texel, stride;  ///< the first of 2 x 2
  alignas(64) LaneFloats part_x, part_y, brightness_gain;
  std::array<Group, lane_count>* pixels;
  bool nearest = false;  ///< texels are not interpolated
};

/// Two texels beside each other, 2^-112 times as large (cell_image.cpp).
SELVEDGE_INLINE Octet unpack(const CellTexel* texels) {
  Halves halves;
  std::memcpy(&halves, texels, sizeof halves);
  return (Octet)(__builtin_convertvector(halves, Lanes<8>::Bits) << 12);
}

SELVEDGE_INLINE Quad mean_of(const LookLanes& lanes, std::size_t lane, const CellTexel* texels) {
  texels += lanes.texel[lane];
  const Octet upper = unpack(texels);
  const Octet both = upper + (unpack(texels + lanes.stride[lane]) - upper) * lanes.part_y[lane];
  const Quad left = __builtin_shufflevector(both, both, 0, 1, 2, 3);
  const Quad right = __builtin_shufflevector(both, both, 4, 5, 6, 7);
  return left + (right - left) * lanes.part_x[lane];
}

/// Finds the texels around the places within the repeat, and their means.
template <std::size_t N>
SELVEDGE_INLINE void look_lanes(const LanePlaces& places, LookLanes& lanes) {
  using Wide = WideFloat<N>;
  static_assert(offsetof(CellLook, size) % sizeof(Group) == 0);
  const Wide zero(0);
  const Wide one(1);
  for (std::size_t i = 0; i < lane_count; i += N) {
    const Group* from[N];  // NOLINT(modernize-avoid-c-arrays)
    for (std::size_t k = 0; k < N; ++k) from[k] = &lanes.looks[i + k]->size;
    Wide size[4];   // NOLINT(modernize-avoid-c-arrays): texels of a repeat, first x and y
    Wide light[4];  // NOLINT(modernize-avoid-c-arrays): brightness, scale, bounds of the factor
    fetch<N>(from, 0, size);
    fetch<N>(from, 1, light);
    Wide x = Wide::load(&places.u[i]) * size[0] - size[2];
    Wide y = (one - Wide::load(&places.v[i])) * size[1] - size[3];
    x = if_greater(zero, x, x + size[0], x);
    y = if_greater(zero, y, y + size[1], y);
    Wide window[4];  // NOLINT(modernize-avoid-c-arrays): width and height
    fetch<N>(from, 3, window);
    // Beyond a part of a repeat, its nearer border.
    const auto within = [&](const Wide& place, std::size_t axis) __attribute__((always_inline)) {
      return if_greater(place, window[axis],
                        if_greater(place + place, window[axis] + size[axis], zero, window[axis]), place);
    };
    // The yarn there stands out of the plane, and rays of the image came from another side.
    Wide relief[4];  // NOLINT(modernize-avoid-c-arrays): slopes, texels of a step
    fetch<N>(from, 2, relief);
    const Wide half(0.5F);
    std::int32_t nearest[N];      // NOLINT(modernize-avoid-c-arrays)
    alignas(64) float height[N];  // NOLINT(modernize-avoid-c-arrays)
    const Wide stride = window[0] + one;
    store_whole(floor(within(y, 1) + half) * stride + floor(within(x, 0) + half), nearest);
    for (std::size_t k = 0; k < N; ++k) {
      const std::int8_t* const heights = lanes.looks[i + k]->heights;
      height[k] = heights != nullptr ? static_cast<float>(heights[nearest[k]]) : 0.0F;
    }
    const auto moved = [&](const float& slope, const Wide& offset, const Wide& texels)
        __attribute__((always_inline)) {
      return max(min(Wide::load(&slope) - offset, one), -one) * Wide::load(height) * texels;
    };
    x = x + moved(places.slope_x[i], relief[0], relief[2]);
    y = y + moved(places.slope_y[i], relief[1], relief[3]);
    x = within(x - floor(x / size[0]) * size[0], 0);
    y = within(y - floor(y / size[1]) * size[1], 1);
    const Wide column = min(floor(x), window[0] - one);
    const Wide row = min(floor(y), window[1] - one);
    const auto part_of = [&](const Wide& part) __attribute__((always_inline)) {
      return lanes.nearest ? floor(part + Wide(0.5F)) : part;
    };
    part_of(x - column).store(&lanes.part_x[i]);
    part_of(y - row).store(&lanes.part_y[i]);
    store_whole(row * stride + column, &lanes.texel[i]);
    store_whole(stride, &lanes.stride[i]);
    const Wide brighter = Wide::load(&places.brightness[i]) * light[0];
    (max(min(brighter, light[3]), light[2]) * light[1]).store(&lanes.brightness_gain[i]);
  }
  for (std::size_t lane = 0; lane < lane_count; ++lane) {
    const float brighter = lanes.brightness_gain[lane];
    const Quad sum =
        mean_of(lanes, lane, lanes.looks[lane]->texels) * 0x1p112F * Quad{brighter, brighter, brighter, 1};
    std::memcpy(&(*lanes.pixels)[lane], &sum, sizeof sum);
  }
}
SELVEDGE_THREE_BODIES(look_lanes, (const LanePlaces& places, LookLanes& lanes), (places, lanes))

/// Fraction of the yarn at a place that lies between heights over its plane, mm.
float fraction_within(const LookLanes& lanes, std::size_t lane, float low, float high) {
  const CellLook& look = *lanes.looks[lane];
  float all = 0;
  float within = 0;
  for (const int k : {0, 1, 2, 3}) {
    const std::int32_t texel = lanes.texel[lane] + k % 2 + (k < 2 ? 0 : lanes.stride[lane]);
    const float weight = (k % 2 == 0 ? 1 - lanes.part_x[lane] : lanes.part_x[lane]) *
                         (k < 2 ? 1 - lanes.part_y[lane] : lanes.part_y[lane]);
    const float opacity = weight * std::bit_cast<float>(std::uint32_t{look.texels[texel][3]} << 12);
    all += opacity;
    const float height = static_cast<float>(look.heights[texel]) * look.height_step;
    if (height >= low && height <= high) within += opacity;
  }
  return all > 0 ? within / all : 1;
}

/// A look of nothing.
constexpr std::array<CellTexel, 4> empty_texels{};
const CellLook empty_look{.size = {1, 1, 0, 0},
                          .scale = 0,
                          .min_gain = 0,
                          .max_gain = 1,
                          .window_size = {1, 1, 0, 0},
                          .texels = empty_texels.data()};

/// Fraction of yarn along v at a pixel.
float fraction_along_v(const LookLanes& lanes, std::size_t lane) {
  const CellLook& look = *lanes.looks[lane];
  const Variation& variation = *look.variation;
  if (look.heights == nullptr || variation.row_brightness[0].rows == 0 ||
      variation.row_brightness[1].rows == 0)
    return variation.along_v_fraction;
  const std::int8_t* const upper = look.heights + lanes.texel[lane];
  const std::int8_t* const lower = upper + lanes.stride[lane];
  const auto odd = [](std::int8_t height) { return static_cast<float>(height & 1); };
  const auto mean = [](float a, float b, float part) { return a + (b - a) * part; };
  return mean(mean(odd(upper[0]), odd(upper[1]), lanes.part_x[lane]),
              mean(odd(lower[0]), odd(lower[1]), lanes.part_x[lane]), lanes.part_y[lane]);
}

/// The first of these lanes' variations; takes its lanes away.
const Variation& next_variation(const LookLanes& lanes, std::uint32_t& varied, std::uint32_t& own) {
  const Variation* const variation = lanes.looks[std::countr_zero(varied)]->variation;
  own = 0;
  for (std::uint32_t rest = varied; rest != 0; rest &= rest - 1) {
    const int lane = std::countr_zero(rest);
    if (lanes.looks[static_cast<std::size_t>(lane)]->variation == variation) own |= 1U << lane;
  }
  varied &= ~own;
  return *variation;
}

/// Moves these lanes to the places that their variation gives them.
void place_varied(const PlaneLanes& planes, const LookLanes& lanes, std::uint32_t varied, LanePlaces& places,
                  VariedPixels& pixels) {
  LaneFloats fraction;
  const CellLook* const first = lanes.looks[std::countr_zero(varied)];
  bool same = true;  // mostly
  for (const CellLook* look : lanes.looks) same &= look == first;
  fraction.fill(same ? first->offset_weight : 0);
  for (std::size_t k = 0; k < 4; ++k) pixels.fade[k].fill(first->fade[k]);
  float max_weight = first->offset_weight;
  pixels.u = places.u;
  pixels.v = places.v;
  for (std::size_t lane = 0; lane < lane_count; ++lane) {
    const Group& wholes = planes.from[lane][4];
    pixels.repeat_u[lane] = places.repeat_u[lane] + static_cast<int>(wholes[2]);
    pixels.repeat_v[lane] = places.repeat_v[lane] + static_cast<int>(wholes[3]);
    if (same || (varied >> lane & 1) == 0) continue;
    for (std::size_t k = 0; k < 4; ++k) pixels.fade[k][lane] = lanes.looks[lane]->fade[k];
    fraction[lane] = lanes.looks[lane]->offset_weight;
    max_weight = std::max(max_weight, fraction[lane]);
  }
  if (!(max_weight > 0)) return;
  if (same) {
    place_pixels(*first->variation, fraction, pixels);
    varied = 0;
  }
  for (std::uint32_t own = 0; varied != 0;) {
    const Variation& variation = next_variation(lanes, varied, own);
    LaneFloats of_own{};
    for (std::size_t lane = 0; lane < lane_count; ++lane)
      of_own[lane] = (own >> lane & 1) != 0 ? fraction[lane] : 0;
    place_pixels(variation, of_own, pixels);
  }
  places.u = pixels.u;
  places.v = pixels.v;
}

/// Multiplies the radiance of these lanes by the factors of their variation.
void vary_lanes(const LookLanes& lanes, std::uint32_t varied, VariedPixels& pixels, CellShading& shading) {
  for (std::size_t lane = 0; lane < lane_count; ++lane)
    if ((varied >> lane & 1) != 0) pixels.along_v[lane] = fraction_along_v(lanes, lane);
  for (std::uint32_t own = 0; varied != 0;) {
    const Variation& variation = next_variation(lanes, varied, own);
    LaneFloats factors;
    find_variation_factors(variation, pixels, factors);
    for (; own != 0; own &= own - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(own));
      for (std::size_t c = 0; c < 3; ++c) shading.pixels[lane][c] *= factors[lane];
    }
  }
}

}  // namespace

const CellLook* CellPass::look_at(TriangleSide surface, std::int32_t repeat_u, std::int32_t repeat_v, float u,
                                  float v) const {
  const Patches::Place& place = planes_[surface / 2].place;
  if (place.chart < 0) return &empty_look;
  const Patches& patches = store_.patches();
  const std::uint32_t patch =
      patches.patch_at(place, patches.unit_at(repeat_u, u), patches.unit_at(repeat_v, v));
  const CellLook& look = store_.look(2 * patch + surface % 2);
  return look.texels != nullptr ? &look : &empty_look;
}

void CellPass::sample(const CellPixels& pixels, CellShading& shading, const CellPixels* marked) const {
  PlaneLanes planes;
  planes.pixels = &pixels;
  planes.units = static_cast<float>(store_.patches().units_per_repeat());
  for (std::size_t lane = 0; lane < lane_count; ++lane)
    planes.from[lane] = planes_[pixels.surface[lane] / 2].coefficients.data();
  LanePlaces places;
  place_lanes_for_this_processor(planes, places);
  LanePlaces marked_places;
  if (marked != nullptr) {
    planes.pixels = marked;
    place_lanes_for_this_processor(planes, marked_places);
  }
  const LanePlaces& own_places = marked != nullptr ? marked_places : places;
  LookLanes lanes;
  lanes.pixels = &shading.pixels;
  lanes.nearest = nearest_;
  shading.hole_filling_lanes = 0;
  std::uint32_t own = 0;
  std::uint32_t outlines = 0;
  std::uint32_t varied = 0;
  const CellLook* look = &empty_look;
  for (std::size_t lane = 0; lane < lane_count; ++lane) {
    const TriangleSide surface = pixels.surface[lane];
    // Neighbours mostly lie in one patch.
    const bool known = lane > 0 && surface == pixels.surface[lane - 1] &&
                       own_places.repeat_u[lane] == own_places.repeat_u[lane - 1] &&
                       own_places.repeat_v[lane] == own_places.repeat_v[lane - 1] &&
                       own_places.unit[lane] == own_places.unit[lane - 1];
    if (!known) {
      look = look_at(surface, own_places.repeat_u[lane], own_places.repeat_v[lane], own_places.u[lane],
                     own_places.v[lane]);
      own |= look->plane_lights;
    }
    lanes.looks[lane] = look;
    if (look->variation != nullptr) varied |= 1U << lane;
    if (planes_[surface / 2].at_outline && look->heights != nullptr) outlines |= 1U << lane;
    shading.hole_filling_lanes |= static_cast<std::uint32_t>(look->fills_holes) << lane;
  }
  VariedPixels of_variation;
  if (varied != 0) place_varied(planes, lanes, varied, places, of_variation);
  // Rows that leave a part of a repeat show its neighbour's image.
  for (std::uint32_t left = varied; left != 0; left &= left - 1) {
    const auto lane = static_cast<std::size_t>(std::countr_zero(left));
    const CellLook& part = *lanes.looks[lane];
    if (part.window_size[0] == part.size[0]) continue;
    const Group& wholes = planes.from[lane][4];
    const CellLook* const beyond =
        look_at(pixels.surface[lane], of_variation.repeat_u[lane] - static_cast<int>(wholes[2]),
                of_variation.repeat_v[lane] - static_cast<int>(wholes[3]), places.u[lane], places.v[lane]);
    if (beyond->heights != nullptr && beyond->plane_lights == part.plane_lights) lanes.looks[lane] = beyond;
  }
  look_lanes_for_this_processor(places, lanes);
  for (std::size_t lane = 0; own != 0 && lane < lane_count; ++lane) {
    const CellLook& seen = *lanes.looks[lane];
    if (seen.plane_lights == 0) continue;
    const CellTexel* plane = seen.texels;
    Quad sum{};
    for (std::uint32_t left = seen.plane_lights; left != 0; left &= left - 1) {
      plane += static_cast<std::ptrdiff_t>((seen.window_size[0] + 1) * (seen.window_size[1] + 1));
      const float fraction = visibility_of(static_cast<std::size_t>(std::countr_zero(left)),
                                           pixels.surface[lane] / 2, pixels.x[lane], pixels.y[lane]);
      if (fraction > 0) sum += mean_of(lanes, lane, plane) * fraction;
    }
    sum = sum * 0x1p112F * lanes.brightness_gain[lane];
    for (std::size_t c = 0; c < 3; ++c) shading.pixels[lane][c] += sum[c];
  }
  if (varied != 0) vary_lanes(lanes, varied, of_variation, shading);
  if (outlines == 0) return;
  for (std::size_t lane = 0; lane < lane_count; ++lane) {
    if ((outlines >> lane & 1) == 0) continue;
    const TriangleSide surface = pixels.surface[lane];
    const float depth = outline_depth(surface / 2, pixels.x[lane], pixels.y[lane]);
    const float fraction = fraction_within(lanes, lane, -depth, surface % 2 == 0 ? HUGE_VALF : depth);
    for (float& c : shading.pixels[lane]) c *= fraction;
  }
}

}  // namespace selvedge
