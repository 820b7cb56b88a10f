// Strands of fibres at the surface of a yarn or ply, and its changes of colour and thickness (spec/brdf.md,
// "Strands" and "Thickness"): one formula for the bake and for level -1 of a fabric.
//
// The noise is made of 32-bit integers, which shaders and JavaScript have as well; it is periodic with the
// chain.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "format/base/vec.h"

namespace selvedge {

inline constexpr float default_contrast = 0.12F;

/// The strands of a curve in a file.
struct YarnStrands {
  /// Side by side around a yarn or ply; 0: it is smooth. Negative: of yarn turned over, a mirrored one.
  int count = 0;
  int noise_pieces = 2;  ///< parts of the chain over which a strand changes; >= 2
  /// At the chain's end, strand i runs on as strand i + shift: they take shift / count turns about the yarn,
  /// right-handed.
  int shift = 0;
  int seed = 0;
  /// Root mean square of the changes of colour and of thickness along the yarn, relative.
  float irregularity = 0;
  int swells = 1;                     ///< parts of the chain over which these change
  float contrast = default_contrast;  ///< root mean square of the strands' changes of colour, relative
  float row_variation = 0;            ///< of the row's, beyond the repeat (variation.h)
  float marl = 0;                     ///< half the difference of the palest and the darkest ply's shades
  bool operator==(const YarnStrands&) const = default;
  /// Whether the surface differs from a smooth yarn's.
  bool varies() const { return count != 0 || irregularity > 0; }
};

inline constexpr int max_strands = 1024;
inline constexpr int max_noise_pieces = 32768;  ///< and swells, and shift
inline constexpr float max_irregularity = 0.3F;
inline constexpr float max_contrast = 0.4F;
inline constexpr float max_row_variation = 0.6F;
inline constexpr float max_marl = 0.9F;
inline constexpr int max_strand_seed = (1 << 24) - 1;

/// How strands differ: root mean squares, but for the first; by eye, against traced fibres.
inline constexpr float strand_edge_slope = 0.5F;         ///< slope of the surface at a strand's edges
inline constexpr float strand_slope_across_rms = 0.22F;  ///< slope across the fibre
inline constexpr float strand_slope_along_rms = 0.12F;   ///< slope along the fibre
inline constexpr float strand_fibre_turn_rms = 0.16F;    ///< turn of the fibre in the surface, radians
/// Minimum cosine between a strand's normal and the view.
inline constexpr float min_strand_facing = 0.05F;

/// A hash of 32 bits: lowbias32 of Chris Wellons' hash prospector (2018, public domain).
constexpr std::uint32_t hash32(std::uint32_t x) {
  x = (x ^ x >> 16) * 0x7feb352dU;
  x = (x ^ x >> 15) * 0x846ca68bU;
  return x ^ x >> 16;
}

/// Rows of the lattice are strands; one more is the yarn's, and one more place has a strand's offset.
inline constexpr std::uint32_t yarn_noise_row = 0xffff;
inline constexpr std::uint32_t offset_noise_place = 0xffff;
constexpr std::uint32_t strand_noise_bits(std::uint32_t hashed_seed, std::uint32_t row, std::uint32_t place) {
  return hash32(hashed_seed ^ (row << 16 | place));
}

/// A fraction of [0, 1] of the way from one place of the lattice to the next.
template <class T>
struct StrandBlend {
  T current_weight,
      next_weight;  ///< weights, whose squares sum to 1: they keep the variance between the places
  explicit StrandBlend(T part) {
    const T smooth = part * part * (3 - 2 * part);
    const T scale = 1 / std::sqrt(smooth * smooth + (1 - smooth) * (1 - smooth));
    current_weight = (1 - smooth) * scale;
    next_weight = smooth * scale;
  }
  /// Noise of unit variance, from byte k of either place's bits.
  T noise(std::uint32_t a, std::uint32_t b, int k) const {
    constexpr T scale = static_cast<T>(0.013531648);  // sqrt(12 / (256^2 - 1))
    const auto value = [&](std::uint32_t bits) {
      return (static_cast<T>(bits >> 8 * k & 255U) - static_cast<T>(127.5)) * scale;
    };
    return current_weight * value(a) + next_weight * value(b);
  }
};

/// The change by a strand at a point of its surface.
template <class T>
struct StrandPerturbation {
  T across = 0;      ///< slope of the surface across the fibre
  T along = 0;       ///< and along it
  T turn = 0;        ///< of the fibre in the surface, radians
  T brightness = 1;  ///< factor of the albedo
};

/// The shift without whole turns, in [0, count). Precondition: there are strands.
inline std::uint32_t shift_within_turn(const YarnStrands& y) {
  const int count = std::abs(y.count);
  return static_cast<std::uint32_t>((y.shift % count + count) % count);
}

/// Rows of the lattice of the strands of a yarn or ply: its first, and the row of the ply which it goes
/// on as at the chain's end.
struct StrandRows {
  int first_row = 0;
  int next_first_row = 0;
  int plies = 1;  ///< of the yarn
};

/// Bytes of the row of the yarn: a place that is thick is not always bright.
inline constexpr int thickness_noise_byte = 0;
inline constexpr int colour_noise_byte = 3;

/// A change along the yarn, as a multiple of what it is in the mean; `fraction` of the chain's length, of any
/// repeat.
template <class T>
T strand_swell(const YarnStrands& y, T fraction, int byte) {
  if (!(y.irregularity > 0)) return 1;
  fraction -= std::floor(fraction);
  const std::uint32_t seed = hash32(static_cast<std::uint32_t>(y.seed));
  const T place = fraction * static_cast<T>(y.swells);
  const auto here = std::min(static_cast<std::uint32_t>(place), static_cast<std::uint32_t>(y.swells - 1));
  const std::uint32_t next = here + 1 == static_cast<std::uint32_t>(y.swells) ? 0 : here + 1;
  const StrandBlend<T> blend(place - static_cast<T>(here));
  return 1 + static_cast<T>(y.irregularity) * blend.noise(strand_noise_bits(seed, yarn_noise_row, here),
                                                          strand_noise_bits(seed, yarn_noise_row, next),
                                                          byte);
}

/// At `around` turns about the yarn or ply; `fraction` of the chain's length. For yarn turned over, `around`
/// is the original yarn's.
template <class T>
StrandPerturbation<T> strand_perturbation(const YarnStrands& y, T around, T fraction,
                                          const StrandRows& rows = {}) {
  StrandPerturbation<T> change;
  const std::uint32_t seed = hash32(static_cast<std::uint32_t>(y.seed));
  fraction -= std::floor(fraction);
  change.brightness = strand_swell(y, fraction, colour_noise_byte);
  if (y.count == 0) return change;
  const auto count = static_cast<std::uint32_t>(std::abs(y.count));
  if (rows.plies > 1) {
    const auto ply =
        static_cast<T>(rows.first_row) + fraction * static_cast<T>(rows.next_first_row - rows.first_row);
    const T pale = 2 * ply / static_cast<T>(std::abs(y.count) * (rows.plies - 1)) - 1;
    change.brightness *= 1 + static_cast<T>(y.marl) * pale;
  }
  T turns = around - static_cast<T>(y.shift) / static_cast<T>(count) * fraction;
  turns -= std::floor(turns);
  const T strand = turns * static_cast<T>(count);
  const std::uint32_t own = std::min(static_cast<std::uint32_t>(strand), count - 1);
  const std::uint32_t row = own + static_cast<std::uint32_t>(rows.first_row);
  const std::uint32_t later =
      (own + shift_within_turn(y)) % count + static_cast<std::uint32_t>(rows.next_first_row);
  const auto offset = [&](std::uint32_t number) {
    return static_cast<T>(strand_noise_bits(seed, number, offset_noise_place) >> 9U) *
           static_cast<T>(0x1p-23);
  };
  // Pieces of neighbouring strands begin at different places.
  const T place =
      fraction * static_cast<T>(y.noise_pieces) + offset(row) + fraction * (offset(later) - offset(row));
  const auto here = static_cast<std::uint32_t>(place);
  const auto bits = [&](std::uint32_t at) {
    const auto pieces = static_cast<std::uint32_t>(y.noise_pieces);
    return at < pieces ? strand_noise_bits(seed, row, at) : strand_noise_bits(seed, later, at - pieces);
  };
  const StrandBlend<T> blend(place - static_cast<T>(here));
  const std::uint32_t a = bits(here);
  const std::uint32_t b = bits(here + 1);
  const T slope = static_cast<T>(strand_edge_slope) * (2 * (strand - static_cast<T>(own)) - 1) +
                  static_cast<T>(strand_slope_across_rms) * blend.noise(a, b, 0);
  const T sway = static_cast<T>(strand_fibre_turn_rms) * blend.noise(a, b, 2);
  change.across = y.count < 0 ? -slope : slope;
  change.turn = y.count < 0 ? -sway : sway;
  change.along = static_cast<T>(strand_slope_along_rms) * blend.noise(a, b, 1);
  change.brightness *= 1 + static_cast<T>(y.contrast) * blend.noise(a, b, 3);
  return change;
}

/// Turns unit normal and fibre, which are perpendicular, to the strand's. `view`: unit.
template <class T>
void perturb_by_strand(const StrandPerturbation<T>& change, const Imath::Vec3<T>& view,
                       Imath::Vec3<T>& normal, Imath::Vec3<T>& fibre) {
  const Imath::Vec3<T> across = fibre.cross(normal);
  normal = (normal + across * change.across + fibre * change.along).normalized();
  const T short_of = static_cast<T>(min_strand_facing) - normal.dot(view);
  if (short_of > 0) normal = (normal + view * short_of).normalized();
  fibre += across * change.turn;
  fibre = (fibre - normal * fibre.dot(normal)).normalized();
}

}  // namespace selvedge
