// Shades pixels one by one that show more than cell images: surfaces without fabric, what a garment's
// material changes of its fabric, and the published path.
#pragma once

#include "viewer/hybrid/garment_point.h"

namespace selvedge {

/// Radiance times opacity, and opacity, of a pixel without cell images.
V4f shade_pixel(const FrameScene& scene, TriangleSide seen, int x, int y, const PbrPixel& pixel);

/// The same of a pixel with a cell image, as its material changes it: tint, bent normals, occlusion,
/// emission.
V4f apply_material(const FrameScene& scene, TriangleSide seen, int x, int y, const PbrPixel& pixel,
                   const V4f& cell);

}  // namespace selvedge
