// Variation of cloth beyond its repeat (spec/brdf.md, "Variation"): rows of yarn, and lengths along them, are
// brighter and darker than the repeat's mean, thicker and thinner, and off their places. It follows from the
// yarn's YarnStrands::row_variation and from the whole numbers of repeats, by integers of 32 bits.
#pragma once

#include <array>
#include <cstdint>

#include "format/base/vec.h"
#include "format/fabric/yarn_strands.h"
#include "format/simd/group.h"

namespace selvedge {

struct YarnData;
class Yarns;
struct YarnCurve;

/// The yarn of a fabric that runs along u, or along v.
struct RowNoise {
  int rows = 0;          ///< side by side in a repeat; 0: no such yarn
  int lengths = 1;       ///< over which a row changes, in 2^log2_repeats repeats
  int log2_repeats = 0;  ///< 0 unless lengths is 1
  float offset = 0;      ///< of the middle of a row from whole numbers of rows, in [0, 1)
  float amplitude = 0;   ///< of single rows, root mean square, relative
};

struct Variation {
  std::uint32_t seed = 0;
  std::array<RowNoise, 2> row_brightness;  ///< along u, along v
  /// The rows that leave their places, of knits also wales; their change is the way, in repeats.
  std::array<RowNoise, 2> row_offsets;
  float along_v_fraction = 0;  ///< of yarn along v in the cloth seen from above
  bool varies() const { return row_brightness[0].amplitude > 0 || row_brightness[1].amplitude > 0; }
};

inline constexpr float area_amplitude_ratio = 0.25F;  ///< over the change of single rows
inline constexpr float offset_per_amplitude = 0.5F;   ///< of a row from its place, in rows
inline constexpr float max_row_offset = 0.1F;         ///< in rows
inline constexpr int log2_area_rows = 3;
inline constexpr int log2_area_lengths = 2;
inline constexpr float noise_length_mm = 8;
inline constexpr float row_blend_half_width = 0.375F;  ///< half the width in which rows blend, in rows
inline constexpr int max_log2_repeats = 12;
inline constexpr int max_noise_lengths = 4096;
/// Whole numbers of repeats beyond these count as these.
inline constexpr int max_repeat_index = 1 << 30;

/// Whether a curve counts as yarn along v.
bool runs_along_v(const YarnCurve& curve, const V2f& period);
/// The rows along an axis.
RowNoise row_noise_along(const YarnData& yarns, const V2f& period, int axis);
Variation variation_of(const Yarns& yarns);

/// Texture coordinates as whole repeats and the place within them, in [0, 1).
struct RepeatPlace {
  V2i repeat{0, 0};
  V2f fraction{0, 0};
};
RepeatPlace repeat_place(const V2d& uv);

/// Where the fabric is looked up: texture coordinates with the way of their rows. `fraction` of it, in [0,
/// 1].
RepeatPlace displaced_place(const Variation& variation, const RepeatPlace& place, float fraction = 1);
V2d displaced_place(const Variation& variation, const V2d& uv);

/// Fractions of the changes that remain where one pixel shows `pixel` repeats along u and v: of single rows
/// along u, of areas, and both along v.
using VariationFade = Group;
inline constexpr VariationFade no_fade{1, 1, 1, 1};
VariationFade variation_fade(const Variation& variation, const V2f& pixel);

/// Fraction of the way, without which far rows would flicker.
float offset_weight(const VariationFade& fade);

/// The factor of the radiance at displaced_place(), in [0, 2]. `along_v`: fraction of yarn along v.
float variation_at(const Variation& variation, const RepeatPlace& place, float along_v,
                   const VariationFade& fade = no_fade);

/// Numbers of the lattices of changes: rows along u, areas, rows along v, areas; then the places of rows
/// along u, and along v.
inline constexpr std::uint32_t first_row_offset_lattice = 4;
constexpr std::uint32_t variation_key(std::uint32_t seed, std::uint32_t lattice) {
  return hash32(hash32(seed) + lattice);
}

}  // namespace selvedge
