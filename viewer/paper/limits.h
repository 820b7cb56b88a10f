// Checks the limits of the paper's path: which scenes, fabrics and lights it can draw.
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

/// The materials that the evaluation distinguishes: by fabric and by whether they keep its opacity.
struct PaperKinds {
  std::vector<SurfaceMaterial> kinds;  ///< at most paper_kind_limit; other members are not set
  std::vector<int> of_surfaces;        ///< index into `kinds`
};

/// The kinds of the surfaces. OPTION_OUT_OF_RANGE at --path for a surface without fabric, a fabric with
/// layers that the paper does not have, and more texels or kinds than 8 bits can code. Emission, occlusion
/// and yarn are ignored, with a line in `remarks`. `materials` are those of the surfaces; their fabrics
/// exist.
Result<PaperKinds> paper_kinds(const Scene& scene, const std::vector<Surface>& surfaces,
                               const Materials& materials, const std::vector<Fabric>& fabrics,
                               std::vector<std::string>& remarks);

/// OPTION_OUT_OF_RANGE at --path for point and spot lights: the frames do not have positions.
Result<void> check_paper_lights(std::span<const Light> lights);

/// The finest level that OpenGL may choose if the formula chooses none finer than `finest`. It is even, so
/// that the remaining levels keep their differences in blue and the frame its bytes.
int finest_for_paper(int finest);
/// Likewise the coarsest level, clamped to those of a fabric with `levels`.
int coarsest_for_paper(int coarsest, int levels);

}  // namespace selvedge
