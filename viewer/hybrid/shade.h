// Shades pixels one by one that show more than cell images: surfaces without fabric, what a garment's
// material changes of its fabric, and the published path.
#pragma once

#include "viewer/hybrid/garment_point.h"

namespace selvedge {

/// Light of a surface, on which a material's tint is a factor, and what it emits, which no tint changes.
struct SurfaceLight {
  V4f reflected{0, 0, 0, 0};  ///< radiance times opacity, and opacity
  V3f emitted{0, 0, 0};       ///< radiance times opacity
  V4f tinted(const V3f& tint) const;
};

/// The light of a pixel without cell images.
SurfaceLight shade_pixel(const FrameScene& scene, TriangleSide seen, int x, int y, const PbrPixel& pixel);

/// The same of a pixel with a cell image, as its material changes it: textures of the tint, bent normals,
/// occlusion, emission.
SurfaceLight apply_material(const FrameScene& scene, TriangleSide seen, int x, int y, const PbrPixel& pixel,
                            const V4f& cell);

// The published path (Daubert et al. 2001, section 6): its index pass writes colours of 8 bits, and each
// pixel shows nearest texels.

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

}  // namespace selvedge
