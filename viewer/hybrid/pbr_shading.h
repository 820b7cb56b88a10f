// Light on materials without a fabric (pbr_brdf.h), sixteen pixels at once.
#pragma once

#include <span>

#include "viewer/hybrid/shade.h"

namespace selvedge {

/// What PbrPixel::words hold, as numbers.
struct PbrValues {
  V2f slope{0, 0};  ///< of the normal, in the frame of the garment as seen from the front
  float metallic = 0;
  float roughness = 0;
  V3f emission{0, 0, 0};
  float occlusion = 1;
};
PbrValues pbr_values(const PbrPixel& pixel);

/// Radiance, not multiplied by opacity, of the pixels of a block as if none of their surfaces had a fabric.
/// `lights` are in the frames' axes; what is said of light from all sides is ShadingScene's.
void shade_pbr(const ShadingScene& scene, const PixelBlock& block, const LaneFrames& frames,
               std::span<const LaneLight> lights, LaneShading& result);

}  // namespace selvedge
