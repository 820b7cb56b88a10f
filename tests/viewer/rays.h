// The truth that frames are held to: rays through a garment, and on through the yarn that it wears, by the
// scalar march and the reference evaluation of format/fabric.
#pragma once

#include <span>

#include "format/fabric/fabric.h"
#include "format/picture/frame.h"
#include "format/scene/camera.h"
#include "format/scene/lights.h"
#include "format/scene/scene.h"

namespace selvedge::test {

/// Means of 8 x 8 regular rays a pixel, which meet yarn as Yarns::trace() does: hairs are as wide as rays and
/// fewer (spec/brdf.md, "Over a surface"), or texels of the level of their pixel, or of the `forced` one; -2:
/// texels of the pixel's level also where there is yarn.
/// Core materials have factors alone. `shadows`: side of the garment's shadow maps in texels; 0: none.
/// `layers`: surfaces that a ray meets at most.
Frame march(const Scene& scene, std::span<const Fabric> fabrics, const Camera& camera, const V2i& size,
            std::span<const Light> lights, int shadows = 0, int layers = 64, int forced = -1);

}  // namespace selvedge::test
