// Checks of options before drawing.
#pragma once

#include "viewer/render.h"

namespace selvedge {

/// OPTION_OUT_OF_RANGE for sizes and layers beyond their limits.
Result<void> check_size(const FrameSize& size);

/// OPTION_OUT_OF_RANGE for levels, taps and shadow maps beyond their limits, and for options that the path
/// does not support.
Result<void> check_draw(RenderPath path, const DrawOptions& options);

/// check_size() and check_draw().
Result<void> check_options(const RenderOptions& options);

}  // namespace selvedge
