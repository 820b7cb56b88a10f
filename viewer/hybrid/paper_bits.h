// The limits of the published path (Daubert et al. 2001, section 6), whose index pass writes colours of 8
// bits: normals, tangents, texels and mip levels are rounded to them before they are shaded.
#pragma once

#include <string>
#include <vector>

#include "format/scene/scene.h"
#include "viewer/hybrid/texel_lists.h"
#include "viewer/scene/materials.h"

namespace selvedge {

/// Rounds normals and tangents of the block, and texels and levels of `texels`, to colours of 8 bits. The
/// second pass of the blending takes the texel of the coarser level that lies at the centre of the finer
/// level's texel. Yarn shows as texels of level 0.
void round_to_paper_bits(const IndexScene& scene, PixelBlock& block, TexelInputs& texels);

/// OPTION_OUT_OF_RANGE at --path where a material has a fabric that the paper does not have: more than 256
/// texels a side, a light table, or products. A line in `remarks` for each fabric whose yarn shows as texels.
Result<void> check_paper_fabrics(const Scene& scene, const Materials& materials,
                                 const std::vector<Fabric>& fabrics, std::vector<std::string>& remarks);

}  // namespace selvedge
