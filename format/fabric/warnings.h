// Warnings about valid but unwise values of a level: peaks or values that half precision distorts, more light
// going out than coming in.
#pragma once

#include "format/base/issue_sink.h"
#include "format/fabric/fabric.h"

namespace selvedge {

/// The maximum of a lobe over all pairs of directions of the hemisphere, without the cosine:
/// max(|cx|, |cy|, cz, 0)^n. The base is a bilinear form with a diagonal matrix, so its maximum over unit
/// vectors is the largest entry; -cz would need a light or a view below the horizon.
double lobe_peak(const float* lobe);

/// The largest exponent for which rounding of cx, cy and cz to half precision changes a lobe's peak by at
/// most 5 %: rounding to 11 bits changes C by up to 2^-11 C, C^n by about n times this fraction.
inline constexpr float max_half_exponent = 0.05F * 2048;

/// Adds FABRIC_PEAK, at most once each for the level, if a lobe's peak is beyond 65,504, and if `half` (the
/// lobes are stored in 16 bits) and an exponent is beyond max_half_exponent.
void warn_of_peaks(const FabricLevel& level, Side side, int level_index, bool half, IssueSink& sink);

/// Adds FABRIC_PRECISION, at most one per layer, if storing the level's lobes or products in 16 bits changes
/// a texel by more than 5 %. For lobes: the change of rho and of the lobes' peaks, as a fraction of their sum
/// in a channel. For products: the change of the coefficients, as a fraction of the largest. `half`: the
/// layers that are stored in 16 bits.
void warn_of_precision(const FabricLevel& level, Side side, int level_index, const LayerSet& half,
                       IssueSink& sink);

/// Adds FABRIC_ENERGY, at most once each for the level, for light along the normal and from four sides at 60
/// degrees, with a tolerance of 1 %:
/// - if a texel sends out more than a surface that faces the light receives: integral of alpha f v_z dv > 1;
/// - if the mean of the texels is more than the cloth receives: > l_z. Single texels in relief may exceed
/// l_z.
///
/// The integral over directions is one over the unit disc, of alpha f dx dy with (x, y) = (v_x, v_y)
/// (Nusselt's analog), computed as a sum over an N x N grid. A cell's weight is its fraction within the disc,
/// and weights are scaled to the area pi: exact for a Lambert texel. N is 2.5 sqrt(n) for the level's largest
/// exponent n, 24 to 256; for the mirror lobe of these lights the error is then below 1 % up to n = 10,000.
/// Large levels are sampled at every k-th texel, for at most 131,072 pairs of a texel and a direction per
/// light. `reflecting` goes back to the side of the light, `other`, if known, to the other side.
struct LitSide {
  const FabricLevel* level = nullptr;
  const FabricInfo* info = nullptr;  ///< of the level's fabric
};
void warn_of_energy(const LitSide& reflecting, const LitSide& other, int level_index, IssueSink& sink);

}  // namespace selvedge
