// Shades pixels that are small enough to show the yarn itself (spec/brdf.md, "Yarn").
#pragma once

#include <span>

#include "viewer/hybrid/shade.h"

namespace selvedge {

/// Adds the yarn of the blocks' pixels to their light, by its weight. A pixel is looked at in its corners,
/// which neighbours of one surface share. Where these show the same yarn, light or shadow alike, they are all
/// that it takes; else the pixel has scene.points x scene.points points. Blocks that lie together save most.
void add_yarn(const ShadingScene& scene, std::span<ShadedBlock> blocks);

}  // namespace selvedge
