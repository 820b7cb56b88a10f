// The truth above the truth: a swatch of explicit fibres, of which trace_swatch() shows the plies' surfaces.
#pragma once

#include "converter/bake/truth_swatch.h"
#include "converter/stitch/fibre_layout.h"

namespace selvedge {

/// As trace_swatch(), of the fibres of `mesh`, which is that of their stitch: places and heights are its own.
/// There is no ground and no cache: `options.ground` and `options.indirect` count for nothing.
Result<TruthSwatch> trace_fibre_swatch(const Fibres& fibres, const CellMesh& mesh, const std::string& name,
                                       const SwatchShot& shot, const TruthOptions& options = {},
                                       const Progress& progress = {});

}  // namespace selvedge
