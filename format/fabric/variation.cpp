#include "format/fabric/variation.h"

#include <algorithm>
#include <cmath>

#include "format/fabric/yarns.h"

namespace selvedge {
namespace {

/// A place between whole numbers.
struct LatticePlace {
  std::uint32_t whole = 0;
  float part = 0;
};

LatticePlace rows_at(const RowNoise& runs, int repeat, float within) {
  const float x = within * static_cast<float>(runs.rows) + runs.offset;
  const float whole = std::floor(x);
  return {static_cast<std::uint32_t>(repeat) * static_cast<std::uint32_t>(runs.rows) +
              static_cast<std::uint32_t>(whole),
          x - whole};
}

LatticePlace lengths_at(const RowNoise& runs, int repeat, float within) {
  const int repeats = 1 << runs.log2_repeats;
  const float x = (static_cast<float>(repeat & (repeats - 1)) + within) *
                  (static_cast<float>(runs.lengths) / static_cast<float>(repeats));
  const float whole = std::floor(x);
  return {static_cast<std::uint32_t>(repeat >> runs.log2_repeats) * static_cast<std::uint32_t>(runs.lengths) +
              static_cast<std::uint32_t>(whole),
          x - whole};
}

LatticePlace of_areas(const LatticePlace& place, int log2_size) {
  const std::uint32_t size = 1U << log2_size;
  return {static_cast<std::uint32_t>(static_cast<std::int32_t>(place.whole) >> log2_size),
          (static_cast<float>(place.whole & (size - 1)) + place.part) / static_cast<float>(size)};
}

/// Noise of unit variance.
float noise_at(std::uint32_t key, const LatticePlace& row, const LatticePlace& length) {
  const StrandBlend<float> across(row.part);
  const StrandBlend<float> along(length.part);
  const auto of_row = [&](std::uint32_t number) {
    const std::uint32_t bits = hash32(key + number);
    return along.noise(hash32(bits + length.whole), hash32(bits + length.whole + 1), 0);
  };
  return across.current_weight * of_row(row.whole) + across.next_weight * of_row(row.whole + 1);
}

float factor_of(const Variation& variation, std::size_t axis, const RepeatPlace& place,
                const VariationFade& fade) {
  const RowNoise& runs = variation.row_brightness[axis];
  if (!(runs.amplitude > 0)) return 1;
  const int along = static_cast<int>(axis);
  const LatticePlace row = rows_at(runs, place.repeat[1 - along], place.fraction[1 - along]);
  const LatticePlace length = lengths_at(runs, place.repeat[along], place.fraction[along]);
  const auto lattice = static_cast<std::uint32_t>(2 * axis);
  LatticePlace sharp = row;
  sharp.part = std::clamp((row.part - 0.5F) / (2 * row_blend_half_width) + 0.5F, 0.0F, 1.0F);
  const float single = noise_at(variation_key(variation.seed, lattice), sharp, length);
  const float area = noise_at(variation_key(variation.seed, lattice + 1), of_areas(row, log2_area_rows),
                              of_areas(length, log2_area_lengths));
  const float sum =
      runs.amplitude * (fade[lattice] * single + area_amplitude_ratio * fade[lattice + 1] * area);
  return std::clamp(1 + sum, 0.0F, 2.0F);
}

RowNoise with_lengths(float period) {
  RowNoise runs;
  const double lengths = static_cast<double>(period) / static_cast<double>(noise_length_mm);
  runs.lengths = std::clamp(static_cast<int>(std::lround(std::min(lengths, 1e6))), 1, max_noise_lengths);
  runs.log2_repeats = std::clamp(static_cast<int>(std::lround(-std::log2(lengths))), 0, max_log2_repeats);
  return runs;
}

/// The rows along an axis in a tile.
RowNoise row_noise_of(const Yarns& yarns, int axis) {
  const YarnMap& map = yarns.data().map;
  RowNoise runs = row_noise_along(yarns.data(), yarns.period(), axis);
  if (map.empty() || runs.rows == 0) return runs;
  const RowNoise lengths = with_lengths(yarns.tile()[axis]);
  runs.lengths = lengths.lengths;
  runs.log2_repeats = lengths.log2_repeats;
  runs.rows = std::max(1, runs.rows * map_tile_stitches / map.kinds[1 - axis]);
  return runs;
}

/// Wales of a knit are as wide as its rows are high.
RowNoise places_of(const Yarns& yarns, const std::array<RowNoise, 2>& runs, std::size_t axis) {
  RowNoise result = runs[axis];
  const RowNoise& other = runs[1 - axis];
  if (result.rows == 0) {
    const auto along = static_cast<int>(axis);
    const float wales = static_cast<float>(other.rows) * yarns.tile()[1 - along] / yarns.tile()[along];
    result = with_lengths(yarns.tile()[along]);
    result.rows =
        static_cast<int>(std::clamp(std::round(wales), 1.0F, static_cast<float>(max_noise_lengths)));
    result.amplitude = other.amplitude;
  }
  result.amplitude =
      std::min(max_row_offset, offset_per_amplitude * result.amplitude) / static_cast<float>(result.rows);
  return result;
}

}  // namespace

RowNoise row_noise_along(const YarnData& yarns, const V2f& period, int axis) {
  RowNoise runs = with_lengths(period[axis]);
  float squares = 0;
  int curves = 0;
  for_each_curve(yarns, [&](std::size_t, const YarnCurve& curve, std::span<const V3f> nodes) {
    if ((runs_along_v(curve, period) ? 1 : 0) != axis || curve.repeat_offset[axis] == 0) return;
    if (curves == 0) {
      double middle = 0;
      for (const V3f& node : nodes) middle += static_cast<double>(axis == 0 ? -node.y : node.x);
      runs.offset = static_cast<float>(middle / static_cast<double>(nodes.size()) /
                                       static_cast<double>(period[1 - axis]));
    }
    ++curves;
    runs.rows += std::abs(curve.repeat_offset[axis]);
    squares += curve.strands.row_variation * curve.strands.row_variation;
  });
  if (curves == 0) return {};
  // Rows are counted from the middle of the first one.
  runs.offset *= -static_cast<float>(runs.rows);
  runs.offset -= std::floor(runs.offset);
  if (!(runs.offset < 1)) runs.offset = 0;
  runs.amplitude = std::sqrt(squares / static_cast<float>(curves));
  return runs;
}

bool runs_along_v(const YarnCurve& curve, const V2f& period) {
  const V2f way = V2f(curve.repeat_offset) * period;
  return std::abs(way.y) > std::abs(way.x);
}

Variation variation_of(const Yarns& yarns) {
  Variation variation;
  variation.seed = static_cast<std::uint32_t>(yarns.data().curves.front().strands.seed);
  variation.row_brightness = {row_noise_of(yarns, 0), row_noise_of(yarns, 1)};
  if (!variation.varies()) return variation;
  for (std::size_t axis = 0; axis < 2; ++axis)
    variation.row_offsets[axis] = places_of(yarns, variation.row_brightness, axis);
  if (variation.row_brightness[1].rows == 0) return variation;
  if (variation.row_brightness[0].rows == 0) {
    variation.along_v_fraction = 1;
    return variation;
  }
  constexpr int side = 32;
  int along_v = 0;
  int seen = 0;
  for (int i = 0; i < side * side; ++i) {
    const int row = i / side;
    const V2d uv((i % side + 0.5) / side, (row + 0.5) / side);
    const auto hit = yarns.trace(uv, 0, V3f(0, 0, 1));
    if (!hit) continue;
    ++seen;
    const int curve = yarns.geometry().segments[hit->segment].curve;
    along_v += runs_along_v(yarns.data().curves[curve], yarns.period()) ? 1 : 0;
  }
  if (seen > 0) variation.along_v_fraction = static_cast<float>(along_v) / static_cast<float>(seen);
  return variation;
}

RepeatPlace repeat_place(const V2d& uv) {
  RepeatPlace place;
  for (int k = 0; k < 2; ++k) {
    const double whole = std::floor(uv[k]);
    constexpr auto most = static_cast<double>(max_repeat_index);
    place.repeat[k] = static_cast<int>(std::clamp(whole, -most, most));
    place.fraction[k] = static_cast<float>(uv[k] - whole);
  }
  return place;
}

RepeatPlace displaced_place(const Variation& variation, const RepeatPlace& place, float fraction) {
  RepeatPlace result = place;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const RowNoise& runs = variation.row_offsets[axis];
    if (!(runs.amplitude > 0)) continue;
    const int along = static_cast<int>(axis);
    const int across = 1 - along;
    const auto lattice = first_row_offset_lattice + static_cast<std::uint32_t>(axis);
    const float moved =
        place.fraction[across] + fraction * runs.amplitude *
                                     noise_at(variation_key(variation.seed, lattice),
                                              rows_at(runs, place.repeat[across], place.fraction[across]),
                                              lengths_at(runs, place.repeat[along], place.fraction[along]));
    const float whole = std::floor(moved);
    result.repeat[across] =
        std::clamp(place.repeat[across] + static_cast<int>(whole), -max_repeat_index, max_repeat_index);
    result.fraction[across] = moved - whole;
  }
  return result;
}

V2d displaced_place(const Variation& variation, const V2d& uv) {
  if (!variation.varies()) return uv;
  const RepeatPlace place = repeat_place(uv);
  const RepeatPlace moved = displaced_place(variation, place);
  const V2d whole(std::floor(uv.x), std::floor(uv.y));
  return whole + V2d(moved.repeat - place.repeat) + V2d(moved.fraction);
}

float offset_weight(const VariationFade& fade) {
  return std::clamp(4 * std::min(fade[0], fade[2]) - 1, 0.0F, 1.0F);
}

VariationFade variation_fade(const Variation& variation, const V2f& pixel) {
  VariationFade fade = no_fade;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const RowNoise& runs = variation.row_brightness[axis];
    const int along = static_cast<int>(axis);
    const float rows = pixel[1 - along] * static_cast<float>(runs.rows);
    const float lengths =
        pixel[along] * static_cast<float>(runs.lengths) / std::exp2(static_cast<float>(runs.log2_repeats));
    const auto left = [](float across, float long_side) {
      return 1 / (std::max(across, 1.0F) * std::max(long_side, 1.0F));
    };
    fade[2 * axis] = left(rows, lengths);
    fade[2 * axis + 1] = left(std::ldexp(rows, -log2_area_rows), std::ldexp(lengths, -log2_area_lengths));
  }
  return fade;
}

float variation_at(const Variation& variation, const RepeatPlace& place, float along_v,
                   const VariationFade& fade) {
  const float of_u = along_v < 1 ? factor_of(variation, 0, place, fade) : 1;
  const float of_v = along_v > 0 ? factor_of(variation, 1, place, fade) : 1;
  return of_u + along_v * (of_v - of_u);
}

}  // namespace selvedge
