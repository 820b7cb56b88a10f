// The reference of frames: rays through a garment, and on through the yarn that it wears, by the scalar march
// of format/fabric.
#pragma once

#include <span>

#include "format/picture/frame.h"
#include "format/scene/camera.h"
#include "format/scene/lights.h"
#include "viewer/load.h"

namespace selvedge::bench {

/// Means of 8 x 8 regular rays a pixel, which meet yarn as Yarns::trace() does: hairs are as wide as rays and
/// fewer (spec/brdf.md, "Over a surface"). `shadows`: side of the garment's shadow maps in texels; 0: none.
/// Preconditions: a perspective camera, directional lights; all surfaces wear yarn and keep its opacity.
Frame march(const LoadedScene& loaded, const Camera& camera, const V2i& size, std::span<const Light> lights,
            int shadows);

}  // namespace selvedge::bench
