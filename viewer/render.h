// Renders a scene and its fabrics to a frame: all of the paper's section 6.
#pragma once

#include <vector>

#include "format/fabric/fabric.h"
#include "format/picture/frame.h"
#include "format/scene/camera.h"
#include "format/scene/scene.h"
#include "viewer/frame/options.h"
#include "viewer/gl/context.h"

namespace selvedge {

/// All options of a rendering.
struct RenderOptions : FrameSize, DrawOptions {
  RenderPath path = RenderPath::hybrid;
  /// The OpenGL implementation. Automatic: Mesa's software rasteriser: pixels return to the CPU anyway.
  ContextKind context = ContextKind::automatic;
};

/// `fabrics[i]` is scene.fabrics[i]. Needs no display and no GPU. The frame's bytes do not depend on the
/// number of threads. Errors: OPTION_OUT_OF_RANGE, GARMENT_EMPTY, GARMENT_NO_UVS, GLTF_REFERENCE (a missing
/// fabric), GRAPHICS_UNAVAILABLE. Preconditions: scene and fabrics are as their readers leave them.
Result<Frame> render(const Scene& scene, const std::vector<Fabric>& fabrics, const Camera& camera,
                     const RenderOptions& options, RenderStats* stats = nullptr);

}  // namespace selvedge
