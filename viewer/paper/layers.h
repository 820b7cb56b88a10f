// From the paper's frames to light (Daubert et al. 2001, section 6, steps 3 and 4), on all cores.
#pragma once

#include "viewer/hybrid/layers.h"
#include "viewer/paper/pass.h"

namespace selvedge {

/// The lanes that a block has of `frames`' pixel i. `size`: of the whole frame; `at`: the pixel, y from the
/// frame's bottom. Precondition: something is seen there.
void add_pixel(const PaperFrames& frames, std::size_t i, const PaperKinds& kinds,
               std::span<const PackedFabric> fabrics, bool blend, const V2i& size, const V2i& at,
               PixelBlock& block);

/// Lays what a round shows behind what the band's pixels have. The `materials` of `shading` are the
/// kinds, its lights directional. `blend`: as the frames were drawn.
LayerCount shade_round(const PaperFrames& frames, const PaperKinds& kinds, bool blend,
                       const ShadingScene& shading, const BandPixels& pixels);

}  // namespace selvedge
