// Checks of options and fabrics before anything is drawn.
#pragma once

#include <vector>

#include "viewer/render.h"

namespace selvedge {

/// OPTION_OUT_OF_RANGE for sizes and layers beyond what there is.
Result<void> check_size(const FrameSize& size);

/// OPTION_OUT_OF_RANGE for levels, taps and shadow maps beyond what there is, and for what a path does not
/// do.
Result<void> check_draw(RenderPath path, const DrawOptions& options);

/// Both.
Result<void> check_options(const RenderOptions& options);

/// FABRIC_MALFORMED for a fabric without levels, or of levels whose sizes do not follow from level 0.
Result<void> check_fabrics(const Scene& scene, const std::vector<Fabric>& fabrics);

}  // namespace selvedge
