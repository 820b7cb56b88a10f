// What the values of a fabric's layers must be (spec/fabric.md, the table of parts).
#pragma once

#include "format/base/issue_sink.h"
#include "format/fabric/layers.h"

namespace selvedge {

/// Where a value stands: "table/level 2/table.0003.red/5,7".
std::string place_of(Layer layer, int level, const std::string& channel, std::size_t texel, int width);

/// Every value of a layer that the level has: finite and in its range, else FABRIC_NOT_FINITE. The first
/// eight are named, the rest is counted. Precondition: arrays of the right sizes.
void check_values(const FabricLevel& level, int level_index, Layer layer, const LayerShape& shape,
                  IssueSink& sink);

}  // namespace selvedge
