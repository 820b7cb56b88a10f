// A stitch's yarns as a fabric file holds them: chains of round segments.
#pragma once

#include "converter/mesh/yarn_chain.h"
#include "converter/stitch/pattern.h"
#include "format/fabric/yarns.h"

namespace selvedge {

/// Curves, nodes and counts of stations (append_chain()); no light yet. Heights are the pattern's own.
/// Precondition: a valid pattern, its plies laid (lay_plies()).
YarnData yarn_curves_of(const StitchPattern& pattern, const YarnChainOptions& options = {});

}  // namespace selvedge
