// Cloth in other colours: from a fabric of the same yarn, without a make.
#pragma once

#include "converter/mesh/cell_mesh.h"
#include "format/fabric/fabric.h"

namespace selvedge {

/// Whether `cell` has the yarn that the fabric stores, but for its colours, to 1/64 of a radius.
bool differs_only_in_colour(const Fabric& fabric, const YarnCell& cell);

/// The fabric in the colours of `cell`, whose yarn has exact light. Texels keep their opacity and the
/// coefficients of products: only the functions of the light change, by least squares over few views of the
/// yarn; lobes change by the mean of a texel. Its accuracy is unknown. Precondition:
/// differs_only_in_colour(). Roughly: in a fraction of the time, with about that light (recolour_light()),
/// from fewer samples, and with the fallback that was; `yarn`: that light alone, and texels as much lighter
/// as the yarn in the mean.
enum class Recolouring { exact, rough, yarn };
Fabric recolour(const Fabric& fabric, const YarnCell& cell, Recolouring recolouring = Recolouring::exact);

}  // namespace selvedge
