// What a level's values may be, but had better not: peaks that half precision cannot hold, more light going
// out than comes in.
#pragma once

#include "format/base/issue_sink.h"
#include "format/fabric/directions.h"
#include "format/fabric/fabric.h"

namespace selvedge {

/// The largest value of a lobe over all pairs of directions of the hemisphere, without the cosine:
/// max(|cx|, |cy|, cz, 0)^n. The base is a bilinear form with a diagonal matrix, so its largest value over
/// unit vectors is the matrix's largest entry; -cz would need a light or a view below the horizon.
double lobe_peak(const float* lobe);

/// The largest exponent under which a lobe whose cx, cy and cz are rounded to half precision keeps its peak
/// within 5 %: rounding to 11 bits changes C by a share of up to 2^-11, C^n by about n times that.
inline constexpr float largest_half_exponent = 0.05F * 2048;

/// FABRIC_PEAK, at most one of each kind for the level: a lobe's peak is beyond 65,504; or `half` (the lobes
/// are stored in 16 bits) and an exponent beyond largest_half_exponent.
void warn_of_peaks(const FabricLevel& level, int level_index, bool half, IssueSink& sink);

/// FABRIC_PRECISION, at most one per layer: what storing the level's lobes or products in 16 bits does to a
/// texel, if it is more than 5 %. Of lobes: the change of rho and of the lobes' peaks, as a share of their
/// sum in a channel. Of products: the change of the coefficients, as a share of the largest. `half`: the
/// layers that are stored in 16 bits.
void warn_of_precision(const FabricLevel& level, int level_index, const LayerSet& half, IssueSink& sink);

/// FABRIC_ENERGY, at most one of each kind for the level, for light along the normal and from four sides at
/// 60 degrees, always by more than 1 %:
/// - a texel sends out more than a surface that faces the light receives: integral of alpha f v_z dv > 1;
/// - so does the mean of the texels by what falls on the cloth: > l_z. Single texels may, where relief faces
/// the
///   light.
///
/// The integral is one over the unit disc, alpha f dx dy with (x, y) = (v_x, v_y) (Nusselt's analog), and
/// that is a sum over an N x N grid, each cell being weighted by its share within the disc and the weights
/// scaled to the area pi: exact for a Lambert texel. N is 2.5 sqrt(n) for the level's largest exponent n, 24
/// to 256. For the mirror lobe of these lights the sum is then right to 1 % up to n = 10,000. Not all texels
/// are tried where they are many, but each so-many-th: no more than 131,072 pairs of a texel and a direction
/// for each light. `info`: that of the level's fabric.
void warn_of_energy(const FabricLevel& level, const FabricInfo& info, int level_index, IssueSink& sink);

}  // namespace selvedge
