// The 8-bit coding of the paper's frames (Daubert et al. 2001, section 6): three colours and alpha per pixel.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "format/base/vec.h"

namespace selvedge {

/// Red, green, blue, alpha.
using Coded = std::array<std::uint8_t, 4>;

/// Texels per side that red and green can index.
inline constexpr int paper_side_limit = 256;
/// Kinds of cloth that the alpha of a normal can distinguish.
inline constexpr int paper_kind_limit = 127;
/// Difference of adjacent levels in blue, of 255: levels are 0, 0.1, 0.2 and so on.
inline constexpr float paper_level_step = 25.5F;

/// A component n of a direction is coded as (n + 1) / 2; its error is at most 1/255.
inline float decode_component(std::uint8_t colour) { return static_cast<float>(colour) / 127.5F - 1; }
inline V3f decode_direction(const Coded& colour) {
  return {decode_component(colour[0]), decode_component(colour[1]), decode_component(colour[2])};
}

inline std::uint8_t code_level(int level) {
  return static_cast<std::uint8_t>(std::lround(paper_level_step * static_cast<float>(level)));
}
inline float decode_level(std::uint8_t blue) { return static_cast<float>(blue) / paper_level_step; }

/// Alpha of a normal; 0: empty pixel. `kind` is below paper_kind_limit.
constexpr int code_kind(int kind, bool back) { return 1 + 2 * kind + (back ? 1 : 0); }
constexpr int decode_kind(std::uint8_t alpha) { return (alpha - 1) / 2; }
constexpr bool decode_back(std::uint8_t alpha) { return (alpha - 1) % 2 != 0; }

}  // namespace selvedge
