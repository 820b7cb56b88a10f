// The published path (Daubert et al. 2001, section 6): its index pass writes colours of 8 bits, and each
// pixel shows nearest texels.
#pragma once

#include "viewer/hybrid/garment_point.h"

namespace selvedge {

/// The texels of a pixel on the published path: one of `finer`, and below its middle one of the next level.
struct PaperTexels {
  int finer_level = 0;       ///< level
  float coarser_weight = 0;  ///< weight of the next level
  V2f uv{0, 0};              ///< the middle of the finer level's texel
};
/// Levels are 0, 0.1, 0.2 and so on in blue.
PaperTexels paper_texels(const Fabric& fabric, const GarmentPoint& point, int forced);
/// A direction of which each component is coded in 8 bits as (n + 1) / 2; its error is at most 1/255.
V3f round_to_paper_bits(const V3f& direction);

/// Radiance and opacity of a fabric. Yarn shows as texels of level 0.
V4f shade_by_paper(const FrameScene& scene, const GarmentPoint& point);

}  // namespace selvedge
