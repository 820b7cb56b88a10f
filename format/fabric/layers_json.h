// The layers in the attribute text of a fabric file (spec/fabric.md, "Attributes of part 0").
#pragma once

#include <nlohmann/json.hpp>

#include "format/fabric/header.h"
#include "format/fabric/json_member.h"

namespace selvedge {

/// Sets the members `layers` and `digests` of a side's text.
void write_layers(const FabricHeader& header, nlohmann::json& side);

/// Reads them into the header, whose side and number of levels are known. Layers that break a rule are left
/// out.
void read_layers(const Member& side, FabricHeader& header, const FabricLimits& limits);

/// Drops a layer of the header if `others` lacks another that it needs.
void require_layer(FabricHeader& header, LayerKind kind, const FabricHeader& others, LayerKind other,
                   const Member& side);

/// Drops products that lack bases, or functions that they refer to.
void check_bases(FabricHeader& header, const Member& side);

}  // namespace selvedge
