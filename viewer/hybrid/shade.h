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

}  // namespace selvedge
