// Checks of options and fabrics before drawing.
#pragma once

#include <vector>

#include "viewer/render.h"

namespace selvedge {

/// OPTION_OUT_OF_RANGE for sizes and layers beyond their limits.
Result<void> check_size(const FrameSize& size);

/// OPTION_OUT_OF_RANGE for levels, taps and shadow maps beyond their limits, and for options that the path
/// does not support.
Result<void> check_draw(RenderPath path, const DrawOptions& options);

/// check_size() and check_draw().
Result<void> check_options(const RenderOptions& options);

/// FABRIC_MALFORMED for a fabric without levels, or with levels whose sizes do not follow from level 0.
Result<void> check_fabrics(const Scene& scene, const std::vector<Fabric>& fabrics);

}  // namespace selvedge
