// Shades the paper's frames (Daubert et al. 2001, section 6, steps 3 and 4) on all cores.
#pragma once

#include "viewer/hybrid/layers.h"
#include "viewer/paper/pass.h"

namespace selvedge {

/// Adds pixel i of `frames` to a block. `size` is that of the whole frame, `pixel` the pixel with y from the
/// frame's bottom. Precondition: the pixel is not empty.
void add_pixel(const PaperFrames& frames, std::size_t i, const PaperKinds& kinds,
               std::span<const PackedFabric> fabrics, bool blend, const V2i& size, const V2i& pixel,
               PixelBlock& block);

/// Composites a round behind the band's pixels. The `materials` of `shading` are the kinds, its lights
/// directional; `blend` is that of PaperPass::draw().
LayerCount shade_round(const PaperFrames& frames, const PaperKinds& kinds, bool blend,
                       const ShadingScene& shading, const BandPixels& pixels);

}  // namespace selvedge
