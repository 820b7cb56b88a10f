// A stitch's yarns as a fabric file holds them: chains of round segments.
#pragma once

#include "converter/mesh/yarn_chain.h"
#include "converter/stitch/pattern.h"
#include "format/fabric/yarns.h"

namespace selvedge {

/// Curves, nodes and counts of stations (append_chain()); no light yet. Heights are the pattern's own. Yarns
/// of several plies are one curve, or one a ply where the plies turn more often than a file can say or pass a
/// bend so close that they stand still. Refuses what lay_plies() does. Precondition: a valid pattern.
Result<YarnData> yarn_curves_of(const StitchPattern& pattern, const YarnChainOptions& options = {});

}  // namespace selvedge
