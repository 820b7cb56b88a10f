// Variation beyond the repeat at sixteen pixels: the twin of displaced_place() and variation_at()
// (format/fabric/variation.h).
#pragma once

#include "format/fabric/variation.h"
#include "viewer/scene/mesh.h"

namespace selvedge {

struct VariedPixels {
  alignas(64) std::array<std::int32_t, lane_count> repeat_u, repeat_v;
  alignas(64) LaneFloats u, v;  ///< within the repeat
  alignas(64) LaneFloats along_v;
  alignas(64) std::array<LaneFloats, 4> fade;  ///< VariationFade
};

/// Moves the pixels' texture coordinates to their places. Precondition, also below: varies() holds.
void place_pixels(const Variation& variation, const LaneFloats& fraction, VariedPixels& pixels);
/// The factors of all pixels, which are placed.
void find_variation_factors(const Variation& variation, const VariedPixels& pixels, LaneFloats& factors);

}  // namespace selvedge
