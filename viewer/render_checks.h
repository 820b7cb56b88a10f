// What can be asked of a frame, and drawn.
#pragma once

#include <vector>

#include "viewer/render.h"

namespace selvedge {

/// OPTION_OUT_OF_RANGE for sizes, layers and taps beyond what there is, and for what the paper's path or the
/// shader's does not do.
Result<void> check_options(const RenderOptions& options);

/// What a frame may ask of the paper's path; OPTION_OUT_OF_RANGE.
Result<void> check_paper(const RenderOptions& look);

/// OPTION_OUT_OF_RANGE for a shadow map that is too small or too large.
Result<void> check_shadows(const RenderOptions& options);

/// FABRIC_MALFORMED for a fabric without levels, or of levels whose sizes do not follow from level 0.
Result<void> check_fabrics(const Scene& scene, const std::vector<Fabric>& fabrics);

}  // namespace selvedge
