// Fuzz: hairs that stand off the yarns of a mesh.
#pragma once

#include "converter/mesh/cell_mesh.h"
#include "converter/stitch/pattern.h"

namespace selvedge {

/// Limit of memory, in one repeat.
constexpr int max_hairs = 100000;

/// Hairs of the yarns (or plies) of `pattern`, whose surface is `mesh`; places of its vertices name the
/// yarns. They grow evenly spread over the surface, mostly along the fibres, as many as the hairiness asks
/// for. Their lengths are exponential, cut at max_hair times the mean; those of loops return to the surface.
/// The same pattern and seed give the same hairs. Refuses (mesh_invalid) more than max_hairs. Precondition: a
/// valid pattern.
Result<Hairs> grow_hairs(const StitchPattern& pattern, const CellMesh& mesh);

}  // namespace selvedge
