// The limits of the paper's path: which scenes, fabrics and lights it can draw.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "format/fabric/fabric.h"
#include "format/fabric/level_options.h"
#include "format/scene/lights.h"
#include "viewer/scene/materials.h"
#include "viewer/scene/surfaces.h"

namespace selvedge {

/// The materials that the evaluation has to tell apart: by fabric and by whether they keep its opacity.
struct PaperKinds {
  std::vector<SurfaceMaterial> kinds;  ///< at most paper_kind_limit; nothing else of them is set
  std::vector<int> of_surfaces;        ///< index into `kinds`
};

/// The kinds of the surfaces. OPTION_OUT_OF_RANGE at --path for a surface without fabric, a fabric with
/// layers that the paper does not have, and more texels or kinds than 8 bits name. What materials have beside
/// their fabric is left out, with a line in `remarks`. `materials` are those of the surfaces; fabrics exist.
Result<PaperKinds> paper_kinds(const Scene& scene, const std::vector<Surface>& surfaces,
                               const Materials& materials, const std::vector<Fabric>& fabrics,
                               std::vector<std::string>& remarks);

/// OPTION_OUT_OF_RANGE at --path for lights that stand somewhere: the frames do not have the pixel's place.
Result<void> check_paper_lights(std::span<const Light> lights);

/// The finest level that OpenGL can choose where the formula chooses none finer than `finest`. Even: the
/// levels that are left then have the same distances in blue as in the whole fabric, and the frame the same
/// bytes.
int finest_for_paper(int finest);
/// The coarsest, likewise; clamped to those that a fabric of `levels` has.
int coarsest_for_paper(int coarsest, int levels);

}  // namespace selvedge
