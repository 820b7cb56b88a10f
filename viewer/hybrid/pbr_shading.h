// Shades materials without a fabric (pbr_brdf.h), sixteen pixels at once.
#pragma once

#include <span>

#include "viewer/hybrid/shade.h"

namespace selvedge {

/// PbrPixel::words, decoded.
struct PbrValues {
  V2f slope{0, 0};  ///< of the normal, in the garment's frame of the front side
  float metallic = 0;
  float roughness = 0;
  V3f emission{0, 0, 0};
  float occlusion = 1;
};
PbrValues pbr_values(const PbrPixel& pixel);

/// Radiance, not multiplied by opacity, of the pixels of a block as if no surface had a fabric. `lights` are
/// in the axes of `frames`; ambient light is ShadingScene::ambient.
void shade_pbr(const ShadingScene& scene, const PixelPlaces& block, const LaneFrames& frames,
               std::span<const LaneLight> lights, LaneShading& result);

}  // namespace selvedge
