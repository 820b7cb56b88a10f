// Shades pixels that are small enough to show the yarn itself (spec/brdf.md, "Yarn").
#pragma once

#include "viewer/hybrid/shade.h"

namespace selvedge {

/// Adds to `sum` the yarn of the block's pixels, at scene.points x scene.points points of each, by its
/// weight.
void add_yarn(const ShadingScene& scene, const PixelBlock& block, const LaneFrames& frames,
              std::span<const LaneLight> lights, LaneShading& sum);

}  // namespace selvedge
