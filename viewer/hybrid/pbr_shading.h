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

/// The share of smooth light from all around a pixel that the scene leaves it, as a white surface that faces
/// along `normal`, in the frame's axes, reflects it; 1 where nothing is known. Precondition: the scene has
/// such light.
float share_around(const ShadingScene& scene, const ShadedBlock& block, std::size_t lane, const V3f& normal);

/// Radiance, not multiplied by opacity, of the pixels of a block as if no surface had a fabric, in its lights
/// and in light from all around.
void shade_pbr(const ShadingScene& scene, const ShadedBlock& block, LaneShading& result);

}  // namespace selvedge
